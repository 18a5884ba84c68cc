"""Print Table 6.1 beside the thesis's figures.

Not a DVC stage: it reads the table that `evaluate_plans` wrote and writes nothing. It needs the standard library alone,
so that showing the table costs no start-up time.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

TABLE = Path("reports/tables/table_6_1.csv")
STUDY = Path("studies/tables/motions_gaps.csv")  # robojoule_predicted where the robot is not its entry, if studied
COLUMNS = (
    "relaxation_percent",
    "krc_segments",
    "method",
    "saving_percent",
    "saving_percent_published_convention",
    "gap_to_optimum_percent",
    "trees",
)
# Title of a block, column, that of the study, ending of the thesis's columns in its Table 6.1.
BLOCKS = (
    (
        "Energy saved at equal cycle time, Eq. 6.1 [%]",
        "saving_percent",
        "saving_mean_percent",
        "_saving_percent_eq_6_1",
    ),
    (
        "The same against the thesis's printed baselines, which accumulate waits [%]",
        "saving_percent_published_convention",
        None,
        "_saving_percent",
    ),
    ("Gap to the proven optimum, re-simulated [%]", "gap_to_optimum_percent", "gap_mean_percent", None),
)

Lines = dict[str, dict[float, float]]


def published() -> list[dict[str, str]]:
    """Rows of the thesis's Table 6.1; its savings by Eq. 6.1 are recomputed from its Tables 6.2 and 6.3."""
    file = resources.files("reproduction.report") / "published" / "table_6_1.csv"
    return list(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))


def table_text(rows: list[dict[str, str]], thesis: list[dict[str, str]], study: Sequence[dict[str, str]] = ()) -> str:
    """Lay out Table 6.1 as text: savings and the thesis's savings by both conventions, gaps to the optimum.

    Args:
        rows: Rows of `table_6_1.csv`, values as text.
        thesis: Rows of the thesis's table, see `published`.
        study: Rows of the study's gaps.

    Returns:
        Several lines without a final line break.
    """
    percents = sorted({float(row["relaxation_percent"]) for row in rows})
    blocks = [
        (title, _own(rows, column) | _studied(study, studied), _published(thesis, ending))
        for title, column, studied, ending in BLOCKS
    ]
    width = max(len(label) for _, own, published in blocks for label in (*own, *published)) + 2
    rule = "-" * (width + 9 * len(percents))
    trees = " to ".join(sorted({row["trees"] for row in rows}, key=float))
    head = "cycle time".ljust(width) + "".join(f"{percent:>7g} %" for percent in percents)
    lines = [f"Table 6.1: {trees} trees, beside the thesis (CTU in Prague, 2023)", rule, head, rule]
    for title, own, published in blocks:
        lines.append(title)
        for label, values in (*own.items(), *published.items()):
            cells = (f"{values[r]:>8.2f} " if r in values else " " * 9 for r in percents)
            lines.append(f"  {label}".ljust(width) + "".join(cells))
        lines.append(rule)
    return "\n".join(line.rstrip() for line in lines)


def _own(rows: list[dict[str, str]], column: str) -> Lines:
    lines: Lines = {}
    for row in rows:
        if row[column]:
            label = f"{row['method']}, {row['krc_segments']} segments" if row["krc_segments"] else row["method"]
            lines.setdefault(label, {})[float(row["relaxation_percent"])] = float(row[column])
    return lines


def _studied(study: Sequence[dict[str, str]], column: str | None) -> Lines:
    lines: Lines = {}
    for row in study:
        key = (row["regime"], row["method"], row["payload_kg"])
        if column and key == ("same_robot", "robojoule_predicted", "all"):
            label = f"robojoule_predicted, {row['trees']} trees of a robot unlike its entry"
            lines.setdefault(label, {})[float(row["relaxation_percent"])] = float(row[column])
    return lines


def _published(thesis: list[dict[str, str]], ending: str | None) -> Lines:
    lines: Lines = {}
    for method, key in (("KRC polynomial", "krc"), ("predicted", "pred")):
        for row in thesis:
            if ending and row[key + ending]:
                label = f"thesis, {method}, trees of {row['krc_segments']} segments"
                lines.setdefault(label, {})[float(row["relaxation_percent"])] = float(row[key + ending])
    return lines


def main() -> None:
    """Print the table of the folder in which the command runs."""
    try:
        with TABLE.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError) as error:
        raise SystemExit(f"show_table: {TABLE} cannot be read ({error}); run `make repro` first") from None
    if not rows or not set(COLUMNS) <= set(rows[0]):
        raise SystemExit(f"show_table: {TABLE} must have rows with the columns {', '.join(COLUMNS)}")
    study: list[dict[str, str]] = []
    if STUDY.exists():
        with STUDY.open(newline="", encoding="utf-8") as file:
            study = list(csv.DictReader(file))
    try:
        text = table_text(rows, published(), study)
    except (ValueError, TypeError, KeyError):
        raise SystemExit(
            f"show_table: {TABLE} or {STUDY} holds a cell that is not a number; run `make repro` again"
        ) from None
    sys.stdout.write(text + "\n")


if __name__ == "__main__":
    main()
