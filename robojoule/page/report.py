"""A plan beside the program as given, with the trade-off that it stands on: everything that the page shows."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from robojoule.arrays import Array
from robojoule.documents import check_output, write_text
from robojoule.errors import InputError
from robojoule.inputs import as_path
from robojoule.page.packing import DETAILS, packed, slider_end_s
from robojoule.page.trace import CycleTrace, Step, cycle_trace
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun
from robojoule.planning.pareto import TradeOff
from robojoule.planning.plan import Plan
from robojoule.programs.operation_tree import OperationTree
from robojoule.robots.robot import Robot
from robojoule.year import Yearly

SUFFIXES = (".html",)
_FOLDER = Path(__file__).parent
_PROFILE_POINTS = 33
MOST_BYTES = 480_000  # of a page; one that is larger says so


@dataclass(frozen=True, eq=False)
class Report:
    """A plan, the program as given, and the trade-off between energy and cycle time.

    Attributes:
        plan: The plan.
        yearly: What it means in a year.
        trade_off: Least energy over cycle time.
        given: The program as given, in time; it waits at its end for the rest of the plan's cycle time.
        planned: The plan, in time.
        given_speed_limits: Speed limit of each movement in the program as given, shape (V,), fractions. [-]
        speed_limits: Speed limits for durations of each movement: V arrays of two rows, durations and fractions.
        figures: Where the figures of the robot come from, a sentence for each group.
    """

    plan: Plan
    yearly: Yearly
    trade_off: TradeOff
    given: CycleTrace
    planned: CycleTrace
    given_speed_limits: Array
    speed_limits: tuple[Array, ...]
    figures: Mapping[str, str]

    def __repr__(self) -> str:
        return f"Report({self.plan!r})"

    def to_dict(self) -> dict[str, Any]:
        """What the page shows as plain data, ready for JSON."""
        curve = self.trade_off.curve
        return {
            "plan": self.plan.to_dict(),
            "yearly": self.yearly.to_dict(),
            "trade_off": {
                "cycle_times_s": _digits(curve.cycle_times_s, 8),
                "energies_j": _digits(curve.energies_j, 7),
                "marginal_powers_w": _digits(curve.marginal_powers_w, 4),
                "movements": curve.movements.tolist(),
                "least_durations_s": _digits(curve.least_durations_s),
                "best": curve.best,
                "largest_gap_percent": 100.0 * self.trade_off.largest_gap,
            },
            "given": _trace(self.given),
            "planned": _trace(self.planned),
            "movements": [
                {
                    "name": name,
                    "profile_durations_s": _digits(profile.durations_s),
                    "profile_energies_j": _digits(profile.energies_j),
                    "limit_durations_s": _digits(table[0], 6),
                    "limit_percent": _digits(100.0 * table[1], 6),
                    "given_percent": float(100.0 * given),
                }
                for name, profile, table, given in zip(
                    self.plan.run.names,
                    self.trade_off.profiles,
                    self.speed_limits,
                    self.given_speed_limits,
                    strict=True,
                )
            ],
            "figures": dict(self.figures),
            "notes": [str(note) for note in self.plan.program.notes],
        }

    def page(self) -> str:
        """The page as HTML text; it loads nothing, and says so where the program is too long to show everything."""
        text = (_FOLDER / "page.html").read_text(encoding="utf-8")
        for name in ("uplot.min.css", "page.css", "uplot.min.js", "page.js"):
            text = text.replace(f"/*{name}*/", (_FOLDER / name).read_text(encoding="utf-8").strip())
        for detail in DETAILS:
            held = packed(self, detail)
            data = _as_json(held)
            if len(text) + len(data) <= MOST_BYTES:
                break
        else:
            held["shortened"].append(f"even so the page is larger than {MOST_BYTES / 1e3:.0f} kB")
            data = _as_json(held)
        return text.replace("/*data*/", data)

    def save(self, path: str | Path) -> None:
        """Write the page.

        Raises:
            InputError: The suffix is not .html, or the file cannot be written.
        """
        target = as_path(path, "path")
        if target.suffix.lower() not in SUFFIXES:
            raise InputError(f"unknown file type '{target.suffix}'", file=target, allowed=", ".join(SUFFIXES))
        check_output(target)
        write_text(target, self.page())


def report_of(
    plan: Plan,
    trade_off: TradeOff,
    given: tuple[OperationTree, CycleRun],
    planned: OperationTree,
    batch: TreeBatch,
    year: Yearly,
) -> Report:
    """A report.

    Args:
        plan: The plan.
        trade_off: Energy over cycle time of the same program.
        given: The program as given, in angles of the robot's model, and its run.
        planned: The program with the plan, in such angles.
        batch: The program's motions.
        year: What the plan means in a year.
    """
    sampled = plan.profiles == "simulated"
    before = cycle_trace(batch, *given, sampled=sampled)
    after = cycle_trace(batch, planned, plan.run, sampled=sampled)
    return Report(
        plan=plan,
        yearly=year,
        trade_off=trade_off,
        given=_until(before, plan.cycle_time_s, plan.energy_given_j - given[1].energy_j),
        planned=after,
        given_speed_limits=given[1].speed_limits,
        speed_limits=_speed_limits(batch, trade_off, _until_s(plan, trade_off, given[1])),
        figures=_figures(batch.robot),
    )


def _until(trace: CycleTrace, cycle_time_s: float, waited_j: float) -> CycleTrace:
    """A cycle that waits at its end for the rest of a cycle time, with the energy of that."""
    end = trace.steps[-1].end_s
    rest = cycle_time_s - end
    if rest <= 1e-9:
        return trace
    power = waited_j / rest
    return replace(
        trace,
        steps=(*trace.steps, Step("wait", "until the next cycle", end, cycle_time_s, power)),
        time_s=np.append(trace.time_s, [end, cycle_time_s]),
        power_w=np.append(trace.power_w, [power, power]),
        parts_j={**trace.parts_j, "standing_j": trace.parts_j["standing_j"] + waited_j},
    )


def _until_s(plan: Plan, trade_off: TradeOff, given: CycleRun) -> Array:
    """The longest duration of each movement that the page shows, shape (V,). [s]"""
    slowest = trade_off.curve.plan_durations_s(slider_end_s(trade_off.curve, plan.cycle_time_s))[0]
    return np.asarray(1.01 * np.maximum(slowest, np.maximum(plan.run.durations_s, given.durations_s)))


def _speed_limits(batch: TreeBatch, trade_off: TradeOff, until_s: Array) -> tuple[Array, ...]:
    """Speed limits over durations of each movement, up to given ones, by the timing of the batch."""
    shares = np.linspace(0.0, 1.0, _PROFILE_POINTS)
    first = np.array([profile.d_min_s for profile in trade_off.profiles])
    longest = np.array([profile.d_max_s for profile in trade_off.profiles])
    last = np.clip(until_s, first, np.maximum(first, longest))
    durations = first[:, np.newaxis] * (np.maximum(last, 1e-12) / np.maximum(first, 1e-12))[:, np.newaxis] ** shares
    durations = np.clip(durations, first[:, np.newaxis], last[:, np.newaxis])
    fastest = batch.planned.minimum_durations()
    limits = np.stack(
        [batch.planned.speed_limits_for_durations(np.maximum(column, fastest)) for column in durations.T], axis=1
    )
    return tuple(np.stack(pair) for pair in zip(durations, limits, strict=True))


def _figures(robot: Robot) -> dict[str, str]:
    """Where the figures of a robot come from, by group."""
    file = robot.file
    groups = {name.replace("_", " "): f"{one.kind}: {one.note}" for name, one in file.provenance.items()}
    return {**groups, "drives": file.drives.provenance}


def _trace(trace: CycleTrace) -> dict[str, Any]:
    return {
        "steps": [asdict(step) for step in trace.steps],
        "time_s": _digits(trace.time_s),
        "power_w": _digits(trace.power_w, 5),
        "parts_j": trace.parts_j,
    }


def _as_json(held: Mapping[str, Any]) -> str:
    """Data as a page can hold it: nothing in it ends the element that it stands in."""
    return json.dumps(held, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _digits(values: Array | Sequence[float], digits: int = 9) -> list[float]:
    """Numbers as they are sent: not more digits than anyone sees."""
    return [float(f"{value:.{digits}g}") for value in np.asarray(values).tolist()]
