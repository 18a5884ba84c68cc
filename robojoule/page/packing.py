"""What the page draws, in few bytes: nothing that it does not show, and lines with the points that one can see.

Numbers are whole units and differences (`robojoule.page.thinning.in_steps`), as the page unpacks them. A page of a long
program would be too large with every breakpoint of the trade-off; `Detail` says what is left out, and the page says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array
from robojoule.page.thinning import in_steps, needed_points
from robojoule.page.trace import CycleTrace
from robojoule.planning.pareto import ParetoCurve
from robojoule.profile.piecewise import PiecewiseLinearProfile

if TYPE_CHECKING:
    from robojoule.page.report import Report

TIME_S, ENERGY_J, POWER_W, PERCENT = 1e-5, 1e-3, 1.0, 0.01  # units of what is sent
SPAN = 2000  # units from end to end of a small picture
_PICTURE = 0.002  # error of a small picture, of its height
_POWER = 0.0025  # error of the power over time, of its largest
_LIMIT_PERCENT = 0.04
_BASE = 36


@dataclass(frozen=True)
class Detail:
    """How much a page holds.

    Attributes:
        energy_j: Error of the trade-off; zero for every breakpoint. [J]
        steps: How many steps from breakpoint to breakpoint say which movement takes the time.
        pictures: How many motions have a picture of their profile.
        coarse: By how much lines may be off, in what one can see. [-]
    """

    energy_j: float
    steps: int
    pictures: int
    coarse: float = 1.0


FULL = Detail(0.0, 10**9, 10**9)
DETAILS = (
    FULL,
    Detail(0.002, 20_000, 400),
    Detail(0.01, 20_000, 300),
    Detail(0.02, 12_000, 200, 2.0),
    Detail(0.05, 12_000, 50, 3.0),
    Detail(0.1, 6_000, 0, 5.0),
    Detail(0.5, 3_000, 0, 10.0),
)


def packed(report: Report, detail: Detail = FULL) -> dict[str, Any]:
    """What the page of a report holds.

    Args:
        report: The report.
        detail: How much of it.
    """
    curve, plan = report.trade_off.curve, report.plan.to_dict()
    moves = plan.pop("moves")
    given_s = [step.end_s - step.start_s for step in report.given.steps if step.kind == "move"]
    end_s = slider_end_s(curve, report.plan.cycle_time_s)
    slowest_s = curve.plan_durations_s(end_s)[0]
    trade, shortened = _trade_off(curve, end_s, detail)
    drawn = _drawn(moves, detail.pictures)
    if len(drawn) < len(moves):
        which = f"only the profiles of the {len(drawn)} motions that take most energy" if drawn else "no profiles"
        shortened.append(f"{which} are drawn")
    if detail.coarse > 1.0:
        shortened.append(f"speed limits at the slider are within {detail.coarse * _LIMIT_PERCENT:g} % of full speed")
    return {
        "plan": plan,
        "payloads_kg": report.plan.program.tree.payloads_kg(plan["payload_kg"]),
        "yearly": report.yearly.to_dict(),
        "trade_off": {**trade, "largest_gap_percent": 100.0 * report.trade_off.largest_gap},
        "given": _trace(report.given, detail.coarse),
        "planned": _trace(report.planned, detail.coarse),
        "movements": [
            {
                "name": name,
                "given_percent": round(100.0 * float(limit), 3),
                "given_s": round(before, 5),
                "plan": [move["speed_limit_percent"], *(round(move[key], 4) for key in _SHOWN)],
                "limits": _limits(table, float(longest), detail.coarse),
                "profile": _profile(profile, (before, move["duration_s"], float(longest))) if k in drawn else None,
            }
            for k, (name, limit, before, move, table, longest, profile) in enumerate(
                zip(
                    report.plan.run.names,
                    report.given_speed_limits,
                    given_s,
                    moves,
                    report.speed_limits,
                    slowest_s,
                    report.trade_off.profiles,
                    strict=True,
                )
            )
        ],
        "figures": dict(report.figures),
        "notes": [str(note) for note in report.plan.program.notes],
        "shortened": shortened,
    }


_SHOWN = ("duration_s", "wait_before_s", "wait_after_s", "energy_j")


def slider_end_s(curve: ParetoCurve, planned_s: float) -> float:
    """Where the slider ends: somewhat after the least energy, the plan within it. [s]"""
    first, best = float(curve.cycle_times_s[0]), float(curve.cycle_times_s[curve.best])
    return max(best + 0.15 * (best - first), 1.05 * planned_s, 1.05 * first)


def _trade_off(curve: ParetoCurve, end_s: float, detail: Detail) -> tuple[dict[str, Any], list[str]]:
    """The trade-off up to the end of the slider, and what of it is shortened."""
    inside = int(np.searchsorted(curve.cycle_times_s, end_s))
    times = np.append(curve.cycle_times_s[:inside], end_s)
    energies = np.append(curve.energies_j[:inside], curve.energy_j(end_s))
    points = np.arange(times.size) if detail.energy_j == 0.0 else needed_points(times, energies, detail.energy_j)
    slopes = np.diff(energies[points]) / np.diff(times[points])
    shown = np.repeat(slopes, np.diff(points))
    off_w = float(np.abs(shown - curve.marginal_powers_w[:inside]).max())
    lengths, movements, off_s = _steps(curve, inside, end_s, detail.steps)
    shortened = []
    if points.size < times.size:
        text = f"the trade-off has {points.size} of its {times.size} points here: energies at the slider are within"
        shortened.append(f"{text} {detail.energy_j:g} J, the worth of a second within {off_w:.1f} J")
    if off_s > 0.0:
        shortened.append(f"durations at the slider are within {1000.0 * off_s:.1f} ms of those of the best plan")
    width = 1
    while len(curve.least_durations_s) > _BASE**width:
        width += 1
    return {
        "cycle_times": in_steps(times[points], TIME_S),
        "energies": in_steps(energies[points], ENERGY_J),
        "waiting_power_w": float(curve.marginal_powers_w[-1]),
        "lengths": in_steps(np.append(times[0], times[0] + np.cumsum(lengths)), TIME_S),
        "movements": "".join(np.base_repr(one, _BASE).rjust(width, "0") for one in movements.tolist()),
        "width": width,
        "least_durations": [round(one / TIME_S) for one in curve.least_durations_s.tolist()],
    }, shortened


def _steps(curve: ParetoCurve, inside: int, end_s: float, most: int) -> tuple[Array, NDArray[np.intp], float]:
    """Which movement takes the time from breakpoint to breakpoint: lengths [s], movements, the error of durations [s].

    Where there are more than that many, neighbouring steps of a movement become one, at their middle.
    """
    count = min(inside, curve.movements.size)  # after the last breakpoint time is waited
    owners = curve.movements[:count]
    begins, ends = curve.cycle_times_s[:count], np.minimum(curve.cycle_times_s[1 : count + 1], end_s)
    lengths = ends - begins
    together = -(-count // most)
    if together <= 1:
        return lengths, owners, 0.0
    joined: list[tuple[float, float, int]] = []
    longest = 0.0
    for movement in range(len(curve.least_durations_s)):
        own = np.flatnonzero(owners == movement)
        for first in range(0, own.size, together):
            part = own[first : first + together]
            length = float(lengths[part].sum())
            joined.append((float(lengths[part] @ (begins[part] + ends[part])) / (2.0 * length), length, movement))
            longest = max(longest, length)
    joined.sort()
    return np.array([one[1] for one in joined]), np.array([one[2] for one in joined]), longest


def _limits(table: Array, longest_s: float, coarse: float) -> list[list[int]]:
    """Durations and speed limits, slowest first: the limit is nearly linear in the inverse of the duration."""
    last = min(int(np.searchsorted(table[0], longest_s)) + 1, table.shape[1])
    inverse, percent = 1.0 / np.maximum(table[0, :last][::-1], 1e-9), 100.0 * table[1, :last][::-1]
    points = needed_points(inverse, percent, coarse * _LIMIT_PERCENT)
    return [in_steps(1.0 / inverse[points], TIME_S), in_steps(percent[points], PERCENT)]


def _profile(profile: PiecewiseLinearProfile, marked_s: tuple[float, ...]) -> dict[str, Any]:
    """A profile as it is drawn, in `SPAN` units from end to end: it ends soon after its least and all marked points."""
    x, y = profile.durations_s, profile.energies_j
    end = min(float(x[-1]), max(2.5 * float(x[np.argmin(y)]), 1.02 * max(marked_s)))
    inside = int(np.searchsorted(x, end))
    x, y = np.append(x[:inside], end), np.append(y[:inside], profile.value(end))
    low, high = float(y.min()), max(float(y.max()), float(y.min()) + 1e-9)
    points = needed_points(x, y, _PICTURE * (high - low))
    wide = max(end - float(x[0]), 1e-9)
    return {
        "from_s": round(float(x[0]), 5),
        "to_s": round(end, 5),
        "least_j": round(low, 2),
        "most_j": round(high, 2),
        "x": in_steps((x[points] - x[0]) / wide * SPAN, 1.0),
        "y": in_steps((y[points] - low) / (high - low) * SPAN, 1.0),
    }


def _drawn(moves: list[dict[str, Any]], most: int) -> set[int]:
    """Motions whose profiles are drawn: those that take most energy."""
    return set(sorted(range(len(moves)), key=lambda k: (-moves[k]["energy_j"], k))[:most])


def _trace(trace: CycleTrace, coarse: float) -> dict[str, Any]:
    names = list(dict.fromkeys(step.name for step in trace.steps))
    places = {name: place for place, name in enumerate(names)}
    points = needed_points(trace.time_s, trace.power_w, coarse * _POWER * float(trace.power_w.max()))
    return {
        "names": names,
        "kinds": "".join(step.kind[0] for step in trace.steps),
        "of": [places[step.name] for step in trace.steps],
        "ends": in_steps((step.end_s for step in trace.steps), TIME_S),
        "means": [round(step.power_w) for step in trace.steps],
        "times": in_steps(trace.time_s[points], TIME_S),
        "powers": in_steps(trace.power_w[points], POWER_W),
        "parts_j": {name: round(value, 1) for name, value in trace.parts_j.items()},
    }
