"""What the report says first: the one figure that matters, and three sentences."""

from __future__ import annotations

from dataclasses import dataclass

from reproduction.report.gap_figures import matching
from reproduction.report.results import Results, Rows, number, published

AT_PERCENT = "110"  # of the least cycle time: a tenth more, as a cell often waits anyway
BEST, THESIS = "robojoule_simulated", "predicted_three_segment"


@dataclass(frozen=True)
class Summary:
    """The first words of the report.

    Attributes:
        figure: The figure that matters, with its unit.
        of: What it is.
        sentences: What it means.
    """

    figure: str
    of: str
    sentences: tuple[str, ...]


def summary_of(results: Results) -> Summary | None:
    """The summary of Table 6.1; None before plans were evaluated, or without the rows that it needs."""
    rows = results.table("table_6_1") or []
    best, thesis = _saving(rows, BEST), _saving(rows, THESIS)
    if best is None or thesis is None:
        return None
    gap = max(number(row["gap_to_optimum_percent"]) for row in rows if row["method"] == BEST)
    trees = matching(rows, {"method": BEST})[0]["trees"]
    more = _others(rows)
    return Summary(
        f"{best:.1f} %",
        f"less energy in {int(AT_PERCENT) - 100} % more time",
        (
            f"robojoule's plans of {trees} random programs take {best:.1f} % less energy than the same programs at "
            f"full speed that then wait for a cycle of {AT_PERCENT} % of the least time{more}.",
            f"No plan is better than these by more than {_rounded_up(gap)} % in the mean: each is held against the "
            "proven optimum of its tree.",
            f"The thesis's method, three line segments predicted by a random forest, saves {thesis:.1f} % of the same "
            f"programs{_published()}.",
        ),
    )


def _saving(rows: Rows, method: str) -> float | None:
    found = matching(rows, {"method": method, "relaxation_percent": AT_PERCENT})
    return number(found[0]["saving_percent"]) if found else None


def _published() -> str:
    """What the thesis found by its own Eq. 6.1, as a clause."""
    rows = matching(published("table_6_1"), {"relaxation_percent": AT_PERCENT})
    savings = sorted(number(row["pred_saving_percent_eq_6_1"]) for row in rows if row["pred_saving_percent_eq_6_1"])
    return f"; it was {savings[0]:.1f} to {savings[-1]:.1f} % in the thesis, of other programs" if savings else ""


def _others(rows: Rows) -> str:
    """Savings at the longest cycle time, as a clause."""
    known = [row for row in matching(rows, {"method": BEST}) if number(row["relaxation_percent"]) > int(AT_PERCENT)]
    if not known:
        return ""
    last = max(known, key=lambda row: number(row["relaxation_percent"]))
    return f", and {number(last['saving_percent']):.1f} % at {number(last['relaxation_percent']):g} %"


def _rounded_up(percent: float) -> str:
    """A bound in two decimals that is not below what it bounds."""
    return f"{max(-(-percent * 100.0 // 1) / 100.0, 0.01):.2f}"
