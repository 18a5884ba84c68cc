"""Energy over cycle time of one robot whose controller has standby modes, beside the curve of motors that hold.

With modes, the least energy of a standstill is neither convex nor continuous over its length. But where the rest of a
cycle is waited is one decision (`robojoule.planning.standstills.Offer`), and which other standstills are made just long
enough for a mode are a few more. For each of them the least energy is a convex function of the cycle time, as without
modes, and the least of all these functions is the trade-off. Other standstills are made longer in the order in which
that costs least per second; the bound lets them be made longer by any part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robojoule.arrays import Array, frozen
from robojoule.formats.program import WAIT_STEP_S
from robojoule.planning.graph import OptimizationGraph, process_energy_j
from robojoule.planning.standstills import Offer, Standstills, standstills_of
from robojoule.planning.tree_motions import closes
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.programs.operation_tree import OperationTree
from robojoule.robots.standby import StandbyMode

_DIGITS = 9  # of a second: lengths that differ by less are the same


@dataclass(frozen=True, eq=False)
class _Branch:
    """Least energies for one decision: breakpoints [s], energies there [J], and what each further second costs [W]."""

    times_s: Array
    energies_j: Array
    rest_w: float

    def later(self, more_s: float, more_j: float) -> _Branch:
        """The same after some time [s] and energy [J]."""
        return _Branch(self.times_s + more_s, self.energies_j + more_j, self.rest_w)

    def energy_j(self, times_s: Array) -> Array:
        """Least energies; infinite for cycle times that are too short. [J]"""
        waited = np.maximum(times_s - self.times_s[-1], 0.0) * self.rest_w
        found = np.interp(times_s, self.times_s, self.energies_j) + waited
        return np.where(times_s >= self.times_s[0] * (1.0 - 1e-12), found, np.inf)


@dataclass(frozen=True, eq=False)
class StandbyTradeOff:
    """Least energy of a cycle over its cycle time with waits in standby.

    Attributes:
        cycle_times_s: Cycle times at which the energy bends or falls, and those that were asked for, rising. [s]
        energies_j: Least energies there: they can be executed. [J]
        bounds_j: No plan takes less. [J]
    """

    cycle_times_s: Array
    energies_j: Array
    bounds_j: Array

    @property
    def best(self) -> int:
        """Place of the cycle time with the least energy."""
        return int(np.argmin(self.energies_j))

    @property
    def largest_gap(self) -> float:
        """Largest share by which an energy may be above the least one. [-]"""
        gaps, energies = self.energies_j - self.bounds_j, self.energies_j
        return float(np.max(np.divide(gaps, energies, out=np.zeros_like(gaps), where=energies > 0.0), initial=0.0))

    def to_dict(self) -> dict[str, Any]:
        """The trade-off as plain data, ready for JSON."""
        rows = zip(self.cycle_times_s.tolist(), self.energies_j.tolist(), strict=True)
        return {
            "best_cycle_time_s": float(self.cycle_times_s[self.best]),
            "best_energy_j": float(self.energies_j[self.best]),
            "largest_gap_percent": 100.0 * self.largest_gap,
            "points": [{"cycle_time_s": time, "energy_j": energy} for time, energy in rows],
        }


def trade_off_with_standby(
    tree: OperationTree,
    graph: OptimizationGraph,
    modes: Sequence[StandbyMode],
    idle_w: Array,
    above: Sequence[PiecewiseLinearProfile],
    below: Sequence[PiecewiseLinearProfile],
    times_s: Array,
) -> StandbyTradeOff:
    """The trade-off of a tree.

    Args:
        tree: The tree.
        graph: Its graph.
        modes: Standby modes of the controller.
        idle_w: Power of holding motors at start and end of each motion, shape (V, 2). [W]
        above: Profiles that can be executed, V of them.
        below: Profiles that no motion undercuts.
        times_s: Cycle times of interest, rising, shape (B,). [s]
    """
    required = np.array([[v.least_prior_wait_s, v.least_post_wait_s] for v in graph.vertices])
    places = standstills_of(required, idle_w, modes, closed=closes(tree), step_s=WAIT_STEP_S)
    step_j = process_energy_j(tree)
    starts = _starts(places, step_j)
    rests = {start.offer.power_w: _branch(above, start.offer.power_w, []) for start in starts}
    upper = [
        rests[start.offer.power_w].later(time, energy) for start in starts for time, energy in _longer(places, start)
    ]
    lower = [
        _branch(below, start.offer.power_w, steps).later(time, energy)
        for start in starts
        for time, energy, steps in _relaxed(places, start)
    ]
    bends = np.concatenate([branch.times_s[[0, -1]] for branch in upper])
    after = bends[bends >= times_s[0]]
    times = np.unique(np.concatenate([times_s, after, np.nextafter(after, 0.0)]))
    times = times[times >= times_s[0]]
    energies, bounds = (np.min([branch.energy_j(times) for branch in of], axis=0) for of in (upper, lower))
    return StandbyTradeOff(frozen(times), frozen(energies), frozen(np.minimum(bounds, energies)))


@dataclass(frozen=True)
class _Start:
    """An offer, with time [s] and energy [J] of all standstills as they are required, but for the offer's."""

    offer: Offer
    time_s: float
    energy_j: float


def _starts(places: Standstills, step_j: float) -> list[_Start]:
    """The offers, without those that another one of the same power beats in time and energy."""
    time = sum(float(times[0]) for times in places.times_s)
    energy = sum(float(energies[0]) for energies in places.energies_j) + step_j
    found: list[_Start] = []
    for offer in places.offers():
        times, energies = places.times_s[offer.place], places.energies_j[offer.place]
        more_s, more_j = times[offer.option] - times[0], energies[offer.option] - energies[0]
        found.append(_Start(offer, time + float(more_s), energy + float(more_j)))
    kept: list[_Start] = []
    for start in sorted(found, key=lambda one: (one.offer.power_w, one.time_s, one.energy_j)):
        last = kept[-1] if kept else None
        if last is None or last.offer.power_w != start.offer.power_w or start.energy_j < last.energy_j:
            kept.append(start)
    return kept


def _longer(places: Standstills, start: _Start) -> list[tuple[float, float]]:
    """Times and energies with none, one, two ... of the other standstills made long enough for a mode."""
    steps = [steps[0] for steps in _lengthenings(places, {start.offer.place}) if steps]
    ordered = sorted(steps, key=lambda step: step[1] / step[0])
    useful = [step for step in ordered if step[1] < start.offer.power_w * step[0]]
    times, energies = (
        np.cumsum([first, *(step[k] for step in useful)]) for k, first in enumerate((start.time_s, start.energy_j))
    )
    return list(zip(times.tolist(), energies.tolist(), strict=True))


def _relaxed(places: Standstills, start: _Start) -> list[tuple[float, float, list[tuple[float, float]]]]:
    """Times, energies and further steps that no plan undercuts, by the most that a standstill is made longer.

    One of them is so much longer; the others by any part of what their modes need, up to that. The offer's own counts
    as well, as it stands for others that it beats.
    """
    found: list[tuple[float, float, list[tuple[float, float]]]] = [(start.time_s, start.energy_j, [])]
    longest: dict[float, list[tuple[int, float]]] = {}
    for place, (times, energies) in enumerate(zip(places.times_s, places.energies_j, strict=True)):
        for more_s, more_j in zip(times[1:] - times[0], energies[1:] - energies[0], strict=True):
            longest.setdefault(round(float(more_s), _DIGITS), []).append((place, float(more_j)))
    for most_s, ones in longest.items():
        alone = {place for place, _ in ones} if len(ones) == 1 else set()
        steps = [step for each in _lengthenings(places, alone, most_s) for step in each]
        found.append((start.time_s + most_s, start.energy_j + min(more_j for _, more_j in ones), steps))
    return found


def _lengthenings(places: Standstills, without: set[int], most_s: float = np.inf) -> list[list[tuple[float, float]]]:
    """Steps along the lower hull of each standstill's options, but for some, that need no more than some time.

    Returns:
        Of each such standstill, time and energy more, the cheapest first.
    """
    found = []
    for place, (times, energies) in enumerate(zip(places.times_s, places.energies_j, strict=True)):
        if place in without or times.size == 1:
            continue
        kept = np.append(True, np.diff(times) > 0.0) & (times - times[0] <= most_s + 10.0**-_DIGITS)
        hull = PiecewiseLinearProfile(times[kept], energies[kept]).lower_hull
        found.append(list(zip(np.diff(hull.durations_s).tolist(), np.diff(hull.energies_j).tolist(), strict=True)))
    return found


def _branch(profiles: Sequence[PiecewiseLinearProfile], rest_w: float, steps: Sequence[tuple[float, float]]) -> _Branch:
    """All segments of the profiles' hulls, and further steps, in order of slope as far as waiting costs more."""
    hulls = [profile.lower_hull for profile in profiles]
    lengths = np.concatenate([*(np.diff(hull.durations_s) for hull in hulls), [time for time, _ in steps]])
    rises = np.concatenate([*(np.diff(hull.energies_j) for hull in hulls), [energy for _, energy in steps]])
    slopes = rises / lengths
    order = np.argsort(slopes, kind="stable")
    order = order[slopes[order] < rest_w]
    times, energies = (
        sum(float(of[0]) for of in each) + np.append(0.0, np.cumsum(more[order]))
        for each, more in (([h.durations_s for h in hulls], lengths), ([h.energies_j for h in hulls], rises))
    )
    return _Branch(times, energies, rest_w)
