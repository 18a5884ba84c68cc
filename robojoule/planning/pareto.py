"""Energy over cycle time of one robot, for all cycle times at once.

For one robot without possible collisions the planning model (see `robojoule.planning.milp`) only shares out time:
every second of the cycle is spent in a movement or waited where idling is cheapest. With convex profiles the least
energy is the infimal convolution of the profiles and the idle line, a convex piecewise linear function of the cycle
time: all their segments in order of slope, from the fastest cycle on. No program has to be solved, and no cycle time is
left out.

Its slope is the marginal energy in J per s of cycle time [W]: what one more second of cycle time is worth. Where it
turns positive, more time gains nothing; where it reaches the idle power, all further time is waited.

Profiles that are not convex count with their lower hull. At every breakpoint all movements stand at points of their
profiles, so that the curve is exact there; between two breakpoints one movement alone is on its way through its hull,
and the true least energy lies above the curve by at most the height of the profile over the hull there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robojoule.arrays import Array, freeze
from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.costs import VertexCosts, check_costs, joined_costs
from robojoule.planning.cycle_run import CycleRun
from robojoule.planning.graph import OptimizationGraph, process_energy_j
from robojoule.planning.standby_trade_off import StandbyTradeOff, trade_off_with_standby
from robojoule.profile.adaptive import AdaptiveProfiles
from robojoule.profile.enclosure import Enclosure
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.source import ProfileSource

RELATIVE_ERROR = 5e-4  # of each motion's profile
_LOADS = ("peak_power_w", "peak_torque_ratio", "rms_torque_ratio")
POINT_COLUMNS = ("cycle_time_s", "energy_j", "marginal_power_w")


@dataclass(frozen=True, eq=False)
class ParetoCurve:
    """Least energy of a cycle over its cycle time, linear between breakpoints; immutable.

    Attributes:
        cycle_times_s: Breakpoints from the least cycle time to the one from which on all further time is waited,
            rising strictly, shape (B,). [s]
        energies_j: Least energies, convex, shape (B,). [J]
        marginal_powers_w: Energy per further second of cycle time from each breakpoint on, rising, shape (B,); the last
            one is the least idle power. [W]
        hull_excess_j: How far the least energy may lie above the curve between this breakpoint and the next one, for
            the profile used there is not convex, shape (B,); zero else. [J]
        least_durations_s: Duration of each of the V movements in the fastest cycle, shape (V,). [s]
        movements: Which movement takes the time from each breakpoint to the next one, shape (B - 1,).
    """

    cycle_times_s: Array
    energies_j: Array
    marginal_powers_w: Array
    hull_excess_j: Array
    least_durations_s: Array
    movements: NDArray[np.intp]

    def __post_init__(self) -> None:
        freeze(self)

    def __repr__(self) -> str:
        times, energies = self.cycle_times_s, self.energies_j
        return (
            f"ParetoCurve({energies[0]:.6g} J in {times[0]:.6g} s to {energies[self.best]:.6g} J in "
            f"{times[self.best]:.6g} s, breakpoints={times.size})"
        )

    @property
    def best(self) -> int:
        """Breakpoint with the least energy of all cycle times (the shortest of several): the end of the trade-off."""
        return int(np.argmin(self.energies_j))

    def energy_j(self, cycle_times_s: ArrayLike) -> Array:
        """Least energy at cycle times of any shape. [J]

        Raises:
            CycleTimeTooShort: A cycle time in which the fastest cycle does not fit.
        """
        times = self._checked(cycle_times_s)
        waited = np.maximum(times - self.cycle_times_s[-1], 0.0) * self.marginal_powers_w[-1]
        return np.asarray(np.interp(times, self.cycle_times_s, self.energies_j) + waited)

    def plan_durations_s(self, cycle_times_s: ArrayLike) -> Array:
        """Durations of the V movements in the best plans for cycle times (K,), shape (K, V). [s]

        Raises:
            CycleTimeTooShort: A cycle time in which the fastest cycle does not fit.
        """
        times = np.atleast_1d(self._checked(cycle_times_s))
        bounds, count = self.cycle_times_s, len(self.least_durations_s)
        lengths = np.diff(bounds)
        durations = np.tile(self.least_durations_s, (len(times), 1))
        for row, time in zip(durations, times, strict=True):
            used = np.clip(time - bounds[:-1], 0.0, lengths)  # of each step from breakpoint to breakpoint
            row += np.bincount(self.movements, used, count)
        return durations

    def _checked(self, cycle_times_s: ArrayLike) -> Array:
        times, least = np.asarray(cycle_times_s, dtype=float), float(self.cycle_times_s[0])
        if not (times >= least * (1.0 - 1e-9)).all():
            raise CycleTimeTooShort(float(times.min()), least)
        return times


def pareto_curve(graph: OptimizationGraph, costs: Sequence[VertexCosts], *, fixed_energy_j: float = 0.0) -> ParetoCurve:
    """Least energy over cycle time under given costs.

    Args:
        graph: Graph of one robot.
        costs: Costs of each vertex, in the order of `graph.vertices`.
        fixed_energy_j: Energy that no plan changes (process steps). [J]

    Raises:
        InputError: More than one robot, or costs that do not fit.
    """
    if len(graph.robots) != 1:
        raise InputError("energy over cycle time is computed for one robot only", key="vertices")
    check_costs(graph, costs)
    idle_w = min(min(cost.idle_prior_w, cost.idle_post_w) for cost in costs)
    hulls = [cost.profile.lower_hull for cost in costs]
    owner = np.repeat(np.arange(len(hulls)), [hull.segments for hull in hulls])
    slopes = np.concatenate([hull.slopes_w for hull in hulls])
    lengths = np.concatenate([np.diff(hull.durations_s) for hull in hulls])
    excess = np.concatenate([_excess_j(cost.profile, hull) for cost, hull in zip(costs, hulls, strict=True)])
    order = np.argsort(slopes, kind="stable")
    order = order[slopes[order] < idle_w]
    owner, slopes, lengths, excess = owner[order], slopes[order], lengths[order], excess[order]
    fastest = np.array([hull.d_min_s for hull in hulls])
    waits_s = waits_j = 0.0
    for vertex, cost in zip(graph.vertices, costs, strict=True):
        waits_s += vertex.least_prior_wait_s + vertex.least_post_wait_s
        waits_j += vertex.least_prior_wait_s * cost.idle_prior_w + vertex.least_post_wait_s * cost.idle_post_w
    start_j = fixed_energy_j + waits_j + sum(float(hull.energies_j[0]) for hull in hulls)
    return ParetoCurve(
        cycle_times_s=waits_s + fastest.sum() + np.append(0.0, np.cumsum(lengths)),
        energies_j=start_j + np.append(0.0, np.cumsum(slopes * lengths)),
        marginal_powers_w=np.append(slopes, idle_w),
        hull_excess_j=np.append(excess, 0.0),
        least_durations_s=fastest,
        movements=owner,
    )


def _excess_j(profile: PiecewiseLinearProfile, hull: PiecewiseLinearProfile) -> Array:
    """Largest height of a profile over each segment of its hull, shape (hull.segments,). [J]"""
    heights = profile.energies_j - hull.value(profile.durations_s)
    bounds = np.searchsorted(profile.durations_s, hull.durations_s)
    inside: NDArray[np.float64] = np.maximum.reduceat(heights, bounds[:-1]) if hull.segments else np.zeros(0)
    return np.maximum(inside, 0.0)


@dataclass(frozen=True, eq=False)
class TradeOff:
    """Energy over cycle time of one program from simulated runs.

    Attributes:
        program: Name of the program.
        robot: Name of the robot.
        payload_kg: What the robot carries. [kg]
        curve: What plans on the profiles above the true ones take: it can be executed.
        bound: The same on the profiles below: no plan can undercut it.
        runs: Simulated runs of all motions.
        fastest: Simulation of the fastest cycle, in which powers and torques are largest, if there is one.
        warnings: What to know before a cycle time is chosen, a sentence each.
        profiles: Profile of each movement that the curve is made of.
        standby: The same with waits in standby, where the controller has modes; in `curve` motors hold in every wait.
    """

    program: str
    robot: str
    payload_kg: float
    curve: ParetoCurve
    bound: ParetoCurve
    runs: int
    fastest: CycleRun | None = None
    warnings: tuple[str, ...] = ()
    profiles: tuple[PiecewiseLinearProfile, ...] = ()
    standby: StandbyTradeOff | None = None

    def __repr__(self) -> str:
        return f"TradeOff({self.program!r} on {self.robot!r}: {self.curve!r})"

    @property
    def largest_gap(self) -> float:
        """Largest gap between curve and bound at the curve's breakpoints, relative. [-]

        At the least cycle time there is one plan only, which is its own bound.
        """
        times, energies = self.curve.cycle_times_s[1:], self.curve.energies_j[1:]
        gaps = energies - self.bound.energy_j(times)
        return float(np.max(np.divide(gaps, energies, out=np.zeros_like(gaps), where=energies > 0.0), initial=0.0))

    def to_dict(self, *, until: Literal["least", "waiting"] = "waiting") -> dict[str, Any]:
        """The trade-off as plain data, ready for JSON.

        Args:
            until: Where the points end: at the least energy, or where all further time is waited.
        """
        curve = self.curve
        last = curve.best if until == "least" else curve.cycle_times_s.size - 1
        columns = (curve.cycle_times_s, curve.energies_j, curve.marginal_powers_w)
        rows = zip(*(column[: last + 1].tolist() for column in columns), strict=True)
        return {
            "program": self.program,
            "robot": self.robot,
            "payload_kg": self.payload_kg,
            "least_cycle_time_s": float(curve.cycle_times_s[0]),
            "energy_fastest_j": float(curve.energies_j[0]),
            "best_cycle_time_s": float(curve.cycle_times_s[curve.best]),
            "best_energy_j": float(curve.energies_j[curve.best]),
            "waiting_cycle_time_s": float(curve.cycle_times_s[-1]),
            "waiting_power_w": float(curve.marginal_powers_w[-1]),
            "largest_gap_percent": 100.0 * self.largest_gap,
            "hull_excess_j": float(curve.hull_excess_j[:last].max(initial=0.0)),
            "simulated_runs": self.runs,
            "moves": len(curve.least_durations_s),
            **{name: getattr(self.fastest, name) for name in _LOADS if self.fastest is not None},
            "warnings": list(self.warnings),
            "points": [dict(zip(POINT_COLUMNS, row, strict=True)) for row in rows],
            "standby": None if self.standby is None else self.standby.to_dict(),
        }


def trade_offs(batch: TreeBatch, *, relative_error: float = RELATIVE_ERROR) -> list[TradeOff]:
    """Energy over cycle time of every tree of a batch, with true idle power.

    Args:
        batch: Trees.
        relative_error: Difference of the profiles above and below the true ones, as a share of the least energy of each
            motion. [-]
    """
    idle = [min(batch.idle_prior_w[rows].min(), batch.idle_post_w[rows].min()) for rows in batch.rows]
    slowest, highest_limit = batch.speed_range
    profiles = AdaptiveProfiles(batch.planned, slowest, highest_speed_limit=highest_limit)
    highest = np.repeat(idle, [rows.stop - rows.start for rows in batch.rows])
    profiles.refine(relative_error, highest_slope_w=highest)
    result = []
    for tree, rows in enumerate(batch.rows):
        pairs = [profiles.enclosure(motion) for motion in range(rows.start, rows.stop)]
        curve, bound = (
            pareto_curve(
                batch.graphs[tree],
                joined_costs(side, batch.idle_prior_w[rows], batch.idle_post_w[rows]),
                fixed_energy_j=process_energy_j(batch.trees[tree]),
            )
            for side in ([pair.above for pair in pairs], [pair.below for pair in pairs])
        )
        runs = int(profiles.runs[rows].sum())
        robot = batch.robot
        result.append(
            TradeOff(
                program=batch.trees[tree].name,
                robot=robot.name,
                payload_kg=float(robot.payload.mass_kg),
                curve=curve,
                bound=bound,
                runs=runs,
                profiles=tuple(pair.above for pair in pairs),
                standby=_with_standby(
                    batch, tree, pairs, np.stack([batch.idle_prior_w[rows], batch.idle_post_w[rows]], axis=1), curve
                ),
            )
        )
    return result


def trade_off_on(source: ProfileSource, batch: TreeBatch) -> TradeOff:
    """Energy over cycle time of the one tree of a batch by what a source knows; it is its own bound.

    Args:
        source: Profiles of the motions.
        batch: The tree.
    """
    known = [source.enclosure(motion) for motion in range(batch.planned.motions)]
    fixed_j = process_energy_j(batch.trees[0])
    curve, bound = (
        pareto_curve(
            batch.graphs[0],
            joined_costs(side, source.idle_start_w, source.idle_end_w),
            fixed_energy_j=fixed_j,
        )
        for side in ([one.above for one in known], [one.below for one in known])
    )
    robot = batch.robot
    return TradeOff(
        program=batch.trees[0].name,
        robot=robot.name,
        payload_kg=float(robot.payload.mass_kg),
        curve=curve,
        bound=bound,
        runs=0,
        profiles=tuple(one.above for one in known),
        standby=_with_standby(batch, 0, known, np.stack([source.idle_start_w, source.idle_end_w], axis=1), curve),
    )


def _with_standby(
    batch: TreeBatch, tree: int, known: Sequence[Enclosure], idle_w: Array, curve: ParetoCurve
) -> StandbyTradeOff | None:
    """The trade-off of a tree with waits in standby, if the controller has modes."""
    if not batch.robot.standby:
        return None
    above, below = [one.above for one in known], [one.below for one in known]
    times = curve.cycle_times_s
    return trade_off_with_standby(
        batch.trees[tree], batch.graphs[tree], batch.robot.standby, idle_w, above, below, times
    )
