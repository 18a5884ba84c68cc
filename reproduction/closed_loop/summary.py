"""Tables of the study on hidden machines: each machine's figures, and what was meant to be reached beside them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reproduction.claims import verdict
from reproduction.closed_loop.study import TRACE
from reproduction.tables import Row
from robojoule.arrays import Array, Mask

# Mean and worst of all cases of machines inside the rules and outside, after the first trial and after the second.
# Lateness counts beyond the machine's own deviation from cycle to cycle, which only the one that jitters has.
TARGETS = {
    ("late_percent", True, 1): (0.05, 0.5),
    ("late_percent", True, 2): (0.03, 0.1),
    ("late_percent", False, 1): (0.5, 3.0),
    ("late_percent", False, 2): (0.05, 0.2),
    ("gap_percent", True, 1): (0.1, 0.4),
    ("gap_percent", True, 2): (0.1, 0.3),
    ("gap_percent", False, 1): (0.6, 3.0),
    ("gap_percent", False, 2): (0.4, 1.0),
    ("promise_points", True, 1): (0.5, 2.0),
    ("promise_points", True, 2): (0.5, 2.0),
    ("promise_points", False, 1): (1.2, 3.0),
    ("promise_points", False, 2): (1.2, 3.0),
}
LEAST_HELD_PERCENT = 80.0  # of intervals of nominally 90 %, on each machine
MOST_LATE_PERCENT = 1.0  # of cycles with reserve, inside the rules
NOTICED_PERCENT = 0.01  # of the cycle: less late than this counts as on time
_DIGITS = 4


def machine_rows(cases: Sequence[Row]) -> list[Row]:
    """One row for each machine, look and number of trials."""
    rows = []
    for look, machine, inside, trial in dict.fromkeys(
        (row["look"], row["machine"], row["inside"], row["trial"]) for row in cases
    ):
        found = [r for r in cases if (r["look"], r["machine"], r["trial"]) == (look, machine, trial)]
        late, promise = _column(found, "late_percent"), _promise(found)
        rows.append(
            {"look": look, "machine": machine, "inside": verdict(bool(inside)), "trials": trial}
            | _pair("late", "percent", late)
            | _pair("gap", "percent", _column(found, "gap_percent"))
            | _pair("promise_error", "points", promise)
            | {
                "promise_held_percent": _share(_column(found, "promise_held") > 0.0),
                "late_cases_percent": _share(late > NOTICED_PERCENT),
                "stated_late_percent": round(100.0 * float(_column(found, "late_probability").mean()), _DIGITS),
                "late_with_reserve_cases_percent": _share(
                    _column(found, "late_with_reserve_percent") > NOTICED_PERCENT
                ),
            }
            | _pair("late_nominal", "percent", _column(found, "late_nominal_percent"))
            | _pair("late_one_ratio", "percent", _column(found, "late_one_ratio_percent"))
            | {"cases": len(found)}
        )
    return rows


def target_rows(cases: Sequence[Row]) -> list[Row]:
    """One row for each target: value, limit, held or not; stamps of a trace only."""
    traced = [row for row in cases if row["look"] == TRACE]
    rows: list[Row] = []
    for (figure, inside, trial), limits in TARGETS.items():
        found = [row for row in traced if (row["inside"], row["trial"]) == (inside, trial)]
        values = _promise(found) if figure == "promise_points" else _column(found, figure)
        if figure == "late_percent":
            values = np.maximum(values - _column(found, "own_deviation_percent"), 0.0)
        for what, value, limit in zip(("mean", "worst"), (values.mean(), values.max()), limits, strict=True):
            rows.append(_target(f"{figure}, {what}", _where(inside), trial, float(value), limit, value <= limit))
    for trial in (1, 2):
        of_trial = [row for row in traced if row["trial"] == trial]
        held = min(_column(machine_rows(of_trial), "promise_held_percent").tolist())
        enough = held >= LEAST_HELD_PERCENT
        rows.append(_target("promise_held_percent, least", "all", trial, held, LEAST_HELD_PERCENT, enough))
        known = [row for row in of_trial if row["inside"]]
        late = _share(_column(known, "late_with_reserve_percent") > NOTICED_PERCENT)
        rows.append(
            _target(
                "late_with_reserve_cases_percent", "inside", trial, late, MOST_LATE_PERCENT, late <= MOST_LATE_PERCENT
            )
        )
    return rows


def _where(inside: object) -> str:
    return "inside" if inside else "outside"


def _target(name: str, machines: str, trials: int, value: float, limit: float, held: object) -> Row:
    return {
        "target": name,
        "machines": machines,
        "trials": trials,
        "value": round(value, _DIGITS),
        "limit": limit,
        "held": verdict(bool(held)),
    }


def _column(rows: Sequence[Row], name: str) -> Array:
    return np.array([float(row[name]) for row in rows])  # type: ignore[arg-type]


def _promise(rows: Sequence[Row]) -> Array:
    return np.abs(_column(rows, "promised_saving_percent") - _column(rows, "real_saving_percent"))


def _pair(name: str, unit: str, values: Array) -> Row:
    return {
        f"{name}_mean_{unit}": round(float(values.mean()), _DIGITS),
        f"{name}_worst_{unit}": round(float(values.max()), _DIGITS),
    }


def _share(which: Mask) -> float:
    return round(100.0 * float(np.mean(which)), _DIGITS)
