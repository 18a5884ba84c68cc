"""Print Table 6.1 beside the thesis's figures.

Not a DVC stage: it reads the table that `evaluate_plans` wrote and writes nothing. It needs the standard library alone,
so that showing the table costs no start-up time.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

TABLE = Path("reports/tables/table_6_1.csv")
COLUMNS = ("relaxation_percent", "krc_segments", "method", "saving_percent", "gap_to_optimum_percent", "trees")

# The thesis's savings by its own Eq. 6.1, recomputed from its Tables 6.2 and 6.3. [%] Relaxation -> saving.
THESIS = {
    "thesis, KRC polynomial, 4 segments": {110: 13.37, 121: 22.04, 133: 26.80, 150: 35.89, 175: 36.13, 200: 35.23},
    "thesis, predicted, the same trees": {110: 17.42, 121: 26.70, 133: 28.24, 150: 35.81, 175: 33.86, 200: 32.04},
    "thesis, KRC polynomial, 6 segments": {110: 12.75, 121: 23.45, 133: 31.78},
    "thesis, predicted, their trees": {110: 17.62, 121: 30.64, 133: 33.12},
}


def table_text(rows: list[dict[str, str]]) -> str:
    """Lay out the rows of `table_6_1.csv` as text: savings, the thesis's savings, gaps to the optimum.

    Args:
        rows: Rows of the file, values as text.

    Returns:
        Several lines without a final line break.
    """
    relaxations = sorted({float(row["relaxation_percent"]) for row in rows})
    savings: dict[str, dict[float, float]] = {}
    gaps: dict[str, dict[float, float]] = {}
    for row in rows:
        label = f"{row['method']}, {row['krc_segments']} segments" if row["krc_segments"] else row["method"]
        for values, column in ((savings, "saving_percent"), (gaps, "gap_to_optimum_percent")):
            if row[column]:
                values.setdefault(label, {})[float(row["relaxation_percent"])] = float(row[column])
    width = max(len(label) for label in (*savings, *gaps, *THESIS))
    trees = " to ".join(sorted({row["trees"] for row in rows}, key=float))
    rule = "-" * (width + 9 * len(relaxations))
    head = "cycle time".ljust(width) + "".join(f"{relaxation:>7g} %" for relaxation in relaxations)

    def block(values: dict[str, dict[float, float]]) -> list[str]:
        return [
            label.ljust(width) + "".join(f"{line[r]:>8.2f} " if r in line else " " * 9 for r in relaxations)
            for label, line in values.items()
        ]

    thesis = {label: {float(r): saving for r, saving in line.items()} for label, line in THESIS.items()}
    lines = [f"Table 6.1: energy saved at equal cycle time (Eq. 6.1), {trees} trees [%]", rule, head, rule]
    lines += [*block(savings), rule, *block(thesis), rule, "Gap to the proven optimum [%]", *block(gaps), rule]
    return "\n".join(line.rstrip() for line in lines)


def main() -> None:
    """Print the table of the folder in which the command runs."""
    try:
        with TABLE.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise SystemExit(f"show_table: {TABLE} cannot be read ({error.strerror}); run `make repro` first") from None
    if not rows or not set(COLUMNS) <= set(rows[0]):
        raise SystemExit(f"show_table: {TABLE} must have rows with the columns {', '.join(COLUMNS)}")
    sys.stdout.write(table_text(rows) + "\n")


if __name__ == "__main__":
    main()
