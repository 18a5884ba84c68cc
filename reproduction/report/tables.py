"""Result tables laid out for readers, robojoule's beside the thesis's."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from reproduction.report.gap_figures import PARTS, matching
from reproduction.report.labels import (
    METHODS,
    MODELS,
    STUDIED,
    TARGETS,
    cell_label,
    column_label,
    key_label,
    method_label,
)
from reproduction.report.results import Results, Rows, number, published
from robojoule.plots.style import MINUS

QUANTILES = {"p25": "25 %", "p50": "50 %", "p75": "75 %", "max": "max", "mean": "mean"}
STUDY_COLUMNS = {"saving_percent": "saving_mean_percent", "gap_to_optimum_percent": "gap_mean_percent"}
ERRORS = {"abs": "absolute", "rel_percent": "relative [%]"}


@dataclass(frozen=True)
class Table:
    """A table of text cells.

    Attributes:
        caption: What it shows.
        head: Names of the columns.
        rows: Cells, as many a row as there are columns.
        marked: Rows that are the thesis's, not robojoule's.
    """

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    marked: frozenset[int] = frozenset()


def _cell(value: float, digits: int = 2) -> str:
    return "" if value != value else f"{value:.{digits}f}".replace("-", MINUS)


def table_6_1(results: Results, note: str = "") -> list[Table]:
    """Savings by Eq. 6.1, savings in the published convention, and gaps; one row per method.

    Beside them, what the predictor reaches in a study, on a robot that differs from its entry, with the same payload.

    Args:
        results: Results of all stages.
        note: What every caption says as well.
    """
    tables = []
    for name, what in (("table_6_1", "all experiment trees"), ("table_6_1_thesis", "the thesis's subsets of trees")):
        rows = results.table(name)
        if not rows:
            continue
        for column, caption, suffix in (
            ("saving_percent", "Energy saving by Eq. 6.1 [%]", "saving_percent_eq_6_1"),
            ("saving_percent_published_convention", "Energy saving in the published convention [%]", "saving_percent"),
            ("gap_to_optimum_percent", "Gap to the proven optimum [%]", ""),
        ):
            if column in rows[0]:
                studied = _studied(results, STUDY_COLUMNS.get(column, ""))
                tables.append(_by_cycle_time(f"{caption}, {what}", rows, column, suffix, studied, note))
    return tables


def _studied(results: Results, column: str) -> dict[float, float]:
    """What the predictor reaches in the study of the same robot and payload, by cycle time in per cent."""
    robot = results.robot
    return {
        number(row["relaxation_percent"]): number(row[column])
        for row in matching(
            results.study("motions_gaps"),
            {"regime": "same_robot", "robot": robot.name, "method": "robojoule_predicted"},
        )
        if column and row["payload_kg"] != "all" and number(row["payload_kg"]) == robot.payload.mass_kg
    }


def _by_cycle_time(
    caption: str, rows: Rows, column: str, published_suffix: str, studied: dict[float, float], note: str
) -> Table:
    percents = sorted({number(row["relaxation_percent"]) for row in rows})
    lines: dict[str, dict[float, float]] = {}
    order = list(METHODS)

    def place(row: dict[str, str]) -> tuple[int, int]:
        return order.index(row["method"]) if row["method"] in order else 99, int(row["krc_segments"] or 0)

    for row in sorted(rows, key=place):
        label = method_label(row["method"], row["krc_segments"])
        if row.get("subset"):
            label += f", trees {row['subset']}"
        lines.setdefault(label, {})[number(row["relaxation_percent"])] = number(row[column])
    if studied and METHODS["robojoule_predicted"] in lines:
        lines[STUDIED] = studied
    own = len(lines)
    if published_suffix:
        for method, key in (("KRC polynomial", "krc"), ("predicted", "pred")):
            for row in published("table_6_1"):
                label = f"thesis: {method}, trees of {row['krc_segments']} segments"
                value = number(row[f"{key}_{published_suffix}"])
                lines.setdefault(label, {})[number(row["relaxation_percent"])] = value
    trees = " to ".join(dict.fromkeys(sorted((row["trees"] for row in rows), key=number)))
    return Table(
        f"{caption}; {trees} trees per row. {note}",
        ("method", *(f"{percent:g} %" for percent in percents)),
        tuple(
            (label, *(_cell(values.get(percent, float("nan"))) for percent in percents))
            for label, values in lines.items()
        ),
        frozenset(range(own, len(lines))),
    )


def table_5_1(results: Results) -> Table | None:
    """Errors of the predictors, the thesis's random forest below robojoule's."""
    rows = results.table("table_5_1")
    if not rows:
        return None
    theirs = {row["target"]: row for row in published("table_5_1")}
    body, marked = [], set()
    for target, (label, unit) in TARGETS.items():
        for error, kind in ERRORS.items():
            name = f"{label}, {kind}" + (f" [{unit}]" if error == "abs" else "")
            digits = 3 if error == "abs" and unit == "s" else 2
            for row in rows:
                if (row["target"], row["error"]) == (target, error):
                    cells = (_cell(number(row.get(key)), digits) for key in QUANTILES)
                    body.append((name, MODELS.get(row["model"], row["model"]), *cells))
            if target in theirs:
                marked.add(len(body))
                keys = (f"{'rel' if error == 'rel_percent' else 'abs'}_{key}" for key in QUANTILES)
                values = (
                    number(theirs[target].get(key + ("_percent" if error == "rel_percent" else ""))) for key in keys
                )
                body.append((name, "thesis: random forest", *(_cell(value, digits) for value in values)))
    return Table(
        "Errors of the predictors on held-out motions (Table 5.1); zero savings are left out of relative errors",
        ("target and error", "model", *QUANTILES.values()),
        tuple(body),
        frozenset(marked),
    )


def gap_table(rows: Rows, caption: str, name: str = "method") -> Table:
    """Mean gap with its confidence interval and the worst tree, one row per method, one column per cycle time.

    Args:
        rows: Rows of a table of gaps.
        caption: What it shows.
        name: Column that names the method.
    """
    percents = sorted({number(row["relaxation_percent"]) for row in rows})
    runs = "runs_per_motion" in rows[0]
    body = []
    for method in dict.fromkeys(row[name] for row in rows):
        chosen = {number(row["relaxation_percent"]): row for row in rows if row[name] == method}
        cells = [_gap_cell(chosen.get(percent)) for percent in percents]
        above = max(number(row["above_unoptimized_percent"]) for row in chosen.values())
        needed = [f"{number(chosen[percents[0]]['runs_per_motion']):g}"] if runs else []
        body.append((key_label(method), *needed, *cells, _cell(above, 0)))
    return Table(
        f"{caption}: mean gap to the optimum, 95 % confidence interval, worst tree [%]; {rows[0]['trees']} trees",
        (
            "method",
            *(["runs a new motion"] if runs else []),
            *(f"{percent:g} %" for percent in percents),
            "trees above unoptimised [%]",
        ),
        tuple(body),
    )


def _gap_cell(row: dict[str, str] | None) -> str:
    if row is None:
        return ""
    mean, low, high, worst = (number(row[f"gap_{key}_percent"]) for key in ("mean", "low", "high", "worst"))
    digits = 3 if mean < 1.0 else 2
    return f"{_cell(mean, digits)} ({_cell(low, digits)} to {_cell(high, digits)}), {_cell(worst, digits)}"


def win_table(rows: Rows, caption: str) -> Table:
    """Wins and losses of each method (row) against each other one (column), over all trees and cycle times."""
    methods = list(dict.fromkeys(row["method"] for row in rows))
    duels: dict[tuple[str, str], list[int]] = {}
    for row in rows:
        duel = duels.setdefault((row["method"], row["other"]), [0, 0])
        duel[0] += int(row["wins"])
        duel[1] += int(row["losses"])
    return Table(
        f"{caption}: trees and cycle times in which the method of the row takes less : more energy",
        ("method", *(key_label(other) for other in methods)),
        tuple(
            (
                key_label(method),
                *("" if method == other else "{} : {}".format(*duels[method, other]) for other in methods),
            )
            for method in methods
        ),
    )


def _payloads(rows: Rows) -> str:
    """Single payloads of some rows, such as "0, 10 and 16 kg"."""
    found = [f"{one:g}" for one in sorted({number(row["payload_kg"]) for row in rows if row["payload_kg"] != "all"})]
    return " and ".join(filter(None, (", ".join(found[:-1]), "".join(found[-1:])))) + " kg"


def study_tables(results: Results) -> list[Table]:
    """The tables of the studies; empty if there are none."""
    found = []
    gaps, wins = results.study("motions_gaps") or [], results.study("motions_wins") or []
    for regime, caption in (
        ("same_robot", f"(a) The same robot, new motions, {_payloads(matching(gaps, {'regime': 'same_robot'}))}"),
        ("unseen_payload", "(b) A payload never trained on"),
    ):
        rows = matching(gaps, {"regime": regime, "payload_kg": "all"})
        duels = matching(wins, {"regime": regime})
        found += [gap_table(rows, caption)] if rows else []
        found += [win_table(duels, caption)] if duels else []
    if robots := results.study("robots_gaps"):
        found.append(gap_table(robots, "(c) A robot never trained on, and with 10 and 50 known motions of it"))
    for part, what in PARTS.items():
        rows = matching(results.study("ablations"), {"part": part})
        found += [gap_table(rows, f"What each step brings, {what}", "case")] if rows else []
    for name, caption in (
        ("predictors", "Predictors compared by nested cross-validation, relative errors [%]"),
        ("motions_errors", "Relative errors of profile parameters, regimes (a) and (b) [%]"),
        ("robots_errors", "Medians over robots of relative errors, regime (c) [%]"),
        ("motions_coverage", "Prediction intervals of nominally 90 %, regimes (a) and (b)"),
        ("robots_coverage", "Prediction intervals of nominally 90 %, regime (c)"),
        ("targets", "What was meant to be reached, and what was"),
        ("closed_loop", "Plans on hidden machines, after one trial and after a second"),
        ("closed_loop_targets", "The same: what was meant to be reached, and what was"),
    ):
        if all_rows := results.study(name):
            found.append(_plain(all_rows, caption, frozenset()))
    return found


def plain(results: Results, name: str, caption: str) -> Table | None:
    """A result table as the stage wrote it."""
    rows = results.table(name)
    return _plain(rows, caption, frozenset()) if rows else None


def published_plain(name: str, caption: str) -> Table:
    """A table of the thesis as printed."""
    rows = published(name)
    return _plain(rows, caption, frozenset(range(len(rows))))


def _plain(rows: Rows, caption: str, marked: frozenset[int]) -> Table:
    head = tuple(name for name in rows[0] if name != "note")
    columns = [_column(name, [row[name] or "" for row in rows]) for name in head]
    return Table(caption, tuple(map(column_label, head)), tuple(zip(*columns, strict=True)), marked)


def _column(name: str, texts: list[str]) -> list[str]:
    """Cells of a column: decimals alike where its values are of one size, keys in words."""
    values = {text: number(text) for text in texts if "." in text and number(text) == number(text)}
    sizes = [abs(value) for value in values.values() if value != 0.0]
    alike = bool(sizes) and min(sizes) >= 0.01 and max(sizes) < 1000.0

    def shown(text: str) -> str:
        if text not in values:
            return cell_label(name, text)
        size = abs(values[text])
        return _cell(values[text], 2 if alike else 0 if size >= 1000 else 2 if size >= 0.1 or size == 0 else 4)

    return [shown(text) for text in texts]


def difference(results: Results) -> Table | None:
    """Robojoule's less the thesis's by Eq. 6.1, on its own subsets of trees where there is such a table."""
    rows = results.table("table_6_1_thesis") or results.table("table_6_1")
    if not rows:
        return None

    def savings(percent: float, segments: str) -> tuple[float, float]:
        here = [row for row in rows if number(row["relaxation_percent"]) == percent]
        krc = [row for row in here if (row["method"], row["krc_segments"]) == ("krc_polynomial", segments)]
        subset = krc[0].get("subset") if krc else None
        pred = [row for row in here if row["method"] == "predicted_three_segment" and row.get("subset") == subset]
        saving_krc, saving_pred = (number(found[0]["saving_percent"]) if found else math.nan for found in (krc, pred))
        return saving_krc, saving_pred

    body = []
    for row in published("table_6_1"):
        percent, segments = number(row["relaxation_percent"]), row["krc_segments"]
        krc, pred = savings(percent, segments)
        their_krc, their_pred = number(row["krc_saving_percent_eq_6_1"]), number(row["pred_saving_percent_eq_6_1"])
        values = (
            krc,
            their_krc,
            krc - their_krc,
            pred,
            their_pred,
            pred - their_pred,
            pred - krc,
            their_pred - their_krc,
        )
        body.append((f"{percent:g} %, {segments} segments", *(_cell(value) for value in values)))
    head = (
        "cycle time",
        "KRC, robojoule",
        "KRC, thesis",
        "difference",
        "predicted, robojoule",
        "predicted, thesis",
        "difference",
        "predicted above KRC, robojoule",
        "predicted above KRC, thesis",
    )
    return Table("Savings by Eq. 6.1, robojoule's and the thesis's [percentage points]", head, tuple(body))


def metrics_table(metrics: dict[str, Any]) -> Table:
    """Metrics, one row a value, nested names joined by dots."""
    body: list[tuple[str, ...]] = []

    def walk(prefix: str, value: Any, add: Callable[[tuple[str, ...]], None]) -> None:
        if isinstance(value, dict):
            for key, inner in value.items():
                walk(f"{prefix}.{key}" if prefix else str(key), inner, add)
        elif isinstance(value, float):
            add((prefix, f"{value:.6g}"))
        else:
            add((prefix, str(value)))

    walk("", metrics, body.append)
    return Table("Metrics (reports/metrics.json)", ("metric", "value"), tuple(body))
