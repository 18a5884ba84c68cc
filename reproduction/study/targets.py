"""What the predictor was meant to reach, beside what it reached: one row per target, held or not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from reproduction.claims import verdict
from reproduction.tables import Row

# Median relative errors of saving, optimal duration, penalty. [%]
ERROR_TARGETS = {"energy_saving_j": 3.0, "optimal_duration_s": 1.5, "energy_penalty_j": 1.5}
THESIS_ERRORS = {"energy_saving_j": 10.4, "optimal_duration_s": 4.5, "energy_penalty_j": 4.8}
ORACLE_FACTOR = 1.5  # an error within this of the oracle's counts as reached: nobody knows the hidden state
GAP_TARGETS = {"same_robot": 0.5, "unseen_payload": 1.0}  # mean gap to the optimum [%]
PREDICTED = "robojoule_predicted"
RIVALS = ("krc_polynomial_6", "predicted_three_segment")


def target_rows(
    motions_errors: Sequence[Mapping[str, object]],
    motions_gaps: Sequence[Mapping[str, object]],
    robots_errors: Sequence[Mapping[str, object]],
    robots_gaps: Sequence[Mapping[str, object]],
) -> list[Row]:
    """Judge the result tables; their values may be text, as read from CSV.

    Args:
        motions_errors: Errors of regimes (a) and (b).
        motions_gaps: Gaps of both.
        robots_errors: Medians over robots of regime (c).
        robots_gaps: Gaps of regime (c) over all robots.
    """
    rows: list[Row] = []
    known = [row for row in motions_errors if row["regime"] == "same_robot"]
    for payload in dict.fromkeys(str(row["payload_kg"]) for row in known):
        part = [row for row in known if str(row["payload_kg"]) == payload]
        rows += _errors(part, "rel_p50_percent", PREDICTED, "a", f"{payload} kg")
    whole = [row for row in motions_gaps if row["payload_kg"] == "all"]
    for regime, name in (("same_robot", "a"), ("unseen_payload", "b")):
        gaps = _gaps([row for row in whole if row["regime"] == regime])
        for cycle_time, found in gaps.items():
            rows.append(_row(name, "mean gap", cycle_time, found[PREDICTED], GAP_TARGETS[regime]))
            if regime == "same_robot":
                rows += [_row(name, f"gap of {rival}", cycle_time, found[PREDICTED], found[rival]) for rival in RIVALS]
    above = [float(str(row["above_unoptimized_percent"])) for row in whole if row["method"] == PREDICTED]
    rows.append(_row("a, b", "trees above unoptimized", "all", max(above), 0.0))
    for cycle_time, found in _gaps(robots_gaps).items():
        rows.append(
            _row(
                "c, 0 motions", "gap of nominal physics", cycle_time, found[f"{PREDICTED}_0"], found["nominal_physics"]
            )
        )
        rows.append(_row("c, 50 motions", "mean gap", cycle_time, found[f"{PREDICTED}_50"], GAP_TARGETS["same_robot"]))
        rows.append(
            _row(
                "c, 50 motions",
                "gap of krc_polynomial_6",
                cycle_time,
                found[f"{PREDICTED}_50"],
                found["krc_polynomial_6"],
            )
        )
    for target, limit in THESIS_ERRORS.items():
        value = _error(robots_errors, "rel_p50_median_percent", f"{PREDICTED}_0", "fine", target)
        rows.append(_row("c, 0 motions", f"thesis's median error of {target} (an aim)", "fine", value, limit))
    return rows + _errors(robots_errors, "rel_p50_median_percent", f"{PREDICTED}_50", "c, 50 motions", "all robots")


def _errors(table: Sequence[Mapping[str, object]], column: str, model: str, regime: str, case: str) -> list[Row]:
    rows = []
    for grid in ("measured", "fine"):
        for target, aim in ERROR_TARGETS.items():
            limit = max(aim, ORACLE_FACTOR * _error(table, column, "oracle", grid, target))
            value = _error(table, column, model, grid, target)
            rows.append(_row(regime, f"median error of {target}", f"{case}, {grid} grid", value, limit))
    return rows


def _error(table: Sequence[Mapping[str, object]], column: str, model: str, grid: str, target: str) -> float:
    wanted = (model, grid, target)
    (found,) = [row for row in table if (row["model"], row["grid"], row["target"]) == wanted]
    return float(str(found[column]))


def _gaps(table: Sequence[Mapping[str, object]]) -> dict[str, dict[str, float]]:
    """Cycle time -> method -> mean gap."""
    gaps: dict[str, dict[str, float]] = {}
    for row in table:
        gaps.setdefault(f"{float(str(row['relaxation_percent'])):g} %", {})[str(row["method"])] = float(
            str(row["gap_mean_percent"])
        )
    return gaps


def _row(regime: str, target: str, case: str, value: float, limit: float) -> Row:
    return {
        "regime": regime,
        "target": target,
        "case": case,
        "value_percent": round(value, 4),
        "limit_percent": round(limit, 4),
        "held": verdict(value <= limit),
    }
