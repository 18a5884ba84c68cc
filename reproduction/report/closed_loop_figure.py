"""Plans on hidden machines: how late they are without trials, after one and after two, and what they miss."""

from __future__ import annotations

from typing import Any

from reproduction.report.drawing import Drawing
from reproduction.report.gap_figures import matching
from reproduction.report.results import Results, Rows, number
from robojoule.plots.style import Style

LEAST_SHOWN = 1e-3  # of a logarithmic axis [%]
TRACE = {"look": "trace"}


def closed_loop(results: Results, style: Style) -> Drawing | None:
    """Lateness and gap of each hidden machine's plans; None without the study."""
    rows = matching(results.study("closed_loop"), TRACE)
    if not rows:
        return None
    first, second = (matching(rows, {"trials": trials}) for trials in ("1", "2"))
    figure, (late, gap) = style.figure(0.75, 1, 2, sharey=True)
    colors = style.colors(4)
    for ax, shown in (
        (
            late,
            (
                ("nominal plan", first, "late_nominal"),
                ("one ratio per motion", first, "late_one_ratio"),
                ("after one trial", first, "late"),
                ("after a second", second, "late"),
            ),
        ),
        (gap, ((None, [], ""), (None, [], ""), ("after one trial", first, "gap"), ("after a second", second, "gap"))),
    ):
        for place, ((label, chosen, figure_name), color) in enumerate(zip(shown, colors, strict=True)):
            if label is not None:
                _bars(ax, chosen, figure_name, place, label if ax is late else None, color)
    names = [row["machine"] + ("" if row["inside"] == "true" else " *") for row in first]
    late.set_yticks(range(len(names)), names)
    late.invert_yaxis()
    late.set_xlabel("late [% of the cycle]")
    gap.set_xlabel("energy above its optimum [%]")
    for ax in (late, gap):
        ax.set_xscale("log")
        ax.set_xlim(LEAST_SHOWN, 50.0)
    figure.legend(loc="outside lower center", ncols=4, fontsize=7)
    summary = _summary(first, second)
    return Drawing(
        figure,
        "Plans on machines whose timing nobody told the planner, by catalog entry and trial runs: mean (bar) and worst "
        f"case (line) of how late they are and how far above the machine's own optimum; * outside of every rule that "
        f"is fitted. {summary}.",
        f"Bars of lateness and energy gap for each machine, on logarithmic axes. {summary}.",
    )


def _bars(ax: Any, rows: Rows, name: str, place: int, label: str | None, color: Any) -> None:
    at = [row + (place - 1.5) * 0.2 for row in range(len(rows))]
    means = [max(number(row[f"{name}_mean_percent"]), LEAST_SHOWN) for row in rows]
    worst = [max(number(row[f"{name}_worst_percent"]), LEAST_SHOWN) for row in rows]
    ax.barh(at, [mean - LEAST_SHOWN for mean in means], left=LEAST_SHOWN, height=0.18, color=color, label=label)
    ax.hlines(at, means, worst, color=color, linewidth=1.0)


def _summary(first: Rows, second: Rows) -> str:
    def mean(rows: Rows, column: str) -> str:
        return f"{sum(number(row[column]) for row in rows) / len(rows):.2g} %"

    return (
        f"Mean lateness {mean(first, 'late_nominal_mean_percent')} without trials, "
        f"{mean(first, 'late_mean_percent')} after one trial and {mean(second, 'late_mean_percent')} after a second"
    )
