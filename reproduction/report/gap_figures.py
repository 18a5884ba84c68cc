"""Gaps of all methods to the optimum over the cycle time, with confidence bands; what each step of robojoule brings."""

from __future__ import annotations

from typing import Any

from reproduction.report.drawing import Drawing
from reproduction.report.labels import KNOWN_PLANT, key_label
from reproduction.report.results import Results, Rows, number, published
from robojoule.plots.style import Style

MARKERS = "osD^vP*X<>hd"
LINEAR_BELOW = 0.01  # of a logarithmic axis of gaps [%]
LEFT_OUT = ("optimum", "unoptimized")  # 0 by definition; the gap of not planning at all
WHOLE = {"regime": "same_robot", "payload_kg": "all"}
PARTS = {
    "representation": "representation of the true profile",
    "idle_power": "idle power",
    "predictor": "predictor of the profile",
}


def gap_to_optimum(results: Results, style: Style) -> Drawing:
    """Gaps and savings of the experiment trees; the thesis's published savings beside robojoule's."""
    rows = results.plan_table("gaps")
    figure, (gaps, savings) = style.figure(1.15, 2, 1, sharex=True)
    compared = [row for row in rows if row["method"] not in LEFT_OUT]
    _bands(gaps, compared, style)
    for _, chosen, look in _lines(compared, style):
        savings.plot(*over_cycle_time(chosen, "saving_mean_percent"), **look)
    _draw_published_savings(savings, "KRC polynomial")
    left, right = gaps.get_legend_handles_labels(), savings.get_legend_handles_labels()
    figure.legend(left[0] + right[0], left[1] + right[1], loc="outside lower center", ncols=3, fontsize=6.5)
    return Drawing(
        figure,
        f"Above: mean gap between re-simulated plans and the re-simulated proven optimum of {rows[0]['trees']} trees, "
        "with 95 % confidence bands (bootstrap over trees); the axis is linear below 0.01 %. Below: mean saving by "
        f"Eq. 6.1, with the thesis's published figures in black, of its own trees. {results.plan_bound} "
        f"{KNOWN_PLANT} {_summary(rows)}.",
        "Lines with bands of the gap to the optimum over cycle time, one per method, above lines of the saving with "
        f"the thesis's. {_summary(rows)}. The numbers are in the tables of gaps.",
    )


def savings(results: Results, style: Style) -> Drawing:
    """Saving over the cycle time of every method, with the thesis's savings by Eq. 6.1."""
    figure, ax = style.figure(0.7)
    rows = [
        row | {"method": f"{row['method']}_{row['krc_segments']}" if row["krc_segments"] else row["method"]}
        for row in results.plan_table("table_6_1")
        if row["method"] != "unoptimized"  # it saves nothing, by definition
    ]
    for label, chosen, look in _lines(rows, style):
        ax.plot(*over_cycle_time(chosen, "saving_percent"), **look, label=label)
    _draw_published_savings(ax, "KRC", markersize=5)
    figure.legend(loc="outside lower center", ncols=3, fontsize=7)
    return Drawing(
        figure,
        "Average energy saving against the unoptimised tree that waits at HOME, over the cycle time; coloured: "
        "robojoule, thinner lines lie on wider ones where both coincide; black: the thesis's savings recomputed by "
        f"Eq. 6.1. {results.plan_bound} {KNOWN_PLANT}",
        "Lines of energy saving over cycle time for every method, robojoule's in colour and the thesis's in black. The "
        "numbers stand in Table 6.1.",
    )


def gap_of_study(results: Results, style: Style) -> Drawing | None:
    """The same on plants that differ from the entry, many trees and three payloads; None without a study."""
    rows = matching(results.study("motions_gaps"), WHOLE)
    if not rows:
        return None
    figure, ax = style.figure(0.85)
    _bands(ax, [row for row in rows if row["method"] not in LEFT_OUT], style)
    ax.set_xlabel("cycle time [% of the least one]")
    figure.legend(loc="outside lower center", ncols=3, fontsize=7)
    return Drawing(
        figure,
        f"Mean gap to the best plan known of {rows[0]['trees']} trees with three payloads, on a plant that differs "
        "from its catalog entry, with 95 % confidence bands (bootstrap over trees); the axis is linear below 0.01 %. "
        f"{_summary(rows)}.",
        f"Lines with bands of the gap to the optimum over cycle time, one per method. {_summary(rows)}.",
    )


def ablations(results: Results, style: Style) -> Drawing | None:
    """What each step brings: representation, idle power, predictor, one exchanged at a time; None without a study."""
    rows = results.study("ablations")
    if not rows:
        return None
    figure, axes = style.figure(1.5, len(PARTS), 1, sharex=True, sharey=True)
    texts = []
    for ax, (part, title) in zip(axes, PARTS.items(), strict=True):
        chosen = [row | {"method": row["case"]} for row in rows if row["part"] == part]
        _bands(ax, chosen, style)
        ax.set_title(title, loc="left")
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
        means = {
            case: _mean([r for r in chosen if r["case"] == case]) for case in dict.fromkeys(r["case"] for r in chosen)
        }
        texts.append(f"{title}: " + ", ".join(f"{key_label(case)} {mean:.3g} %" for case, mean in means.items()))
    axes[-1].set_xlabel("cycle time [% of the least one]")
    summary = "; ".join(texts)
    return Drawing(
        figure,
        f"Mean gap to the best plan known with one step exchanged at a time, all else as in the best case; "
        f"{rows[0]['trees']} trees of the study. Mean over the cycle times: {summary}.",
        f"Lines with bands of the gap over cycle time, one plot a step. {summary}.",
    )


def matching(rows: Rows | None, key: dict[str, str]) -> Rows:
    """Rows with these values."""
    return [row for row in rows or [] if all(row.get(name) == value for name, value in key.items())]


def _draw_published_savings(ax: Any, krc: str, **look: Any) -> None:
    """The thesis's savings by Eq. 6.1 in black, the polynomial method called `krc`; names the axes."""
    for method, key, marker in ((krc, "krc", "x"), ("predicted", "pred", "+")):
        for segments, dash in (("4", ":"), ("6", "--")):
            chosen = matching(published("table_6_1"), {"krc_segments": segments})
            ax.plot(
                *over_cycle_time(chosen, f"{key}_saving_percent_eq_6_1"),
                color="black",
                linestyle=dash,
                linewidth=0.8,
                marker=marker,
                label=f"thesis, {method}, {segments} segments",
                **look,
            )
    ax.set(xlabel="cycle time [% of the least one]", ylabel="energy saving, Eq. 6.1 [%]")


def _bands(ax: Any, rows: Rows, style: Style) -> None:
    for label, chosen, look in _lines(rows, style):
        at, mean = over_cycle_time(chosen, "gap_mean_percent")
        low, high = (over_cycle_time(chosen, f"gap_{end}_percent")[1] for end in ("low", "high"))
        ax.fill_between(at, low, high, color=look["color"], alpha=0.2, linewidth=0)
        ax.plot(at, mean, label=label, **look)
    ax.set_yscale("symlog", linthresh=LINEAR_BELOW)
    ax.set(ylim=(0, None), ylabel="gap to the optimum [%]")


def _lines(rows: Rows, style: Style) -> list[tuple[str, Rows, dict[str, Any]]]:
    """One line per method, in the order of the table: label, rows by cycle time, look."""
    methods = list(dict.fromkeys(row["method"] for row in rows))
    lines = []
    for place, (method, color) in enumerate(zip(methods, style.colors(len(methods)), strict=True)):
        chosen = by_cycle_time(matching(rows, {"method": method}))
        # Lines that coincide lie on each other: each is thinner than the one below it, and its marks are smaller.
        share = 1.0 - place / len(methods)
        look = {"color": color, "marker": MARKERS[place % len(MARKERS)], "markersize": 3.0 + 3.5 * share}
        lines.append((key_label(method), chosen, look | {"linewidth": 0.9 + 1.8 * share}))
    return lines


def by_cycle_time(rows: Rows) -> Rows:
    """Rows by rising cycle time."""
    return sorted(rows, key=lambda row: number(row["relaxation_percent"]))


def over_cycle_time(rows: Rows, column: str) -> tuple[list[float], list[float]]:
    """Cycle times and figures of rows, to be drawn as a line."""
    return [number(row["relaxation_percent"]) for row in rows], [number(row[column]) for row in rows]


def _mean(rows: Rows) -> float:
    return sum(number(row["gap_mean_percent"]) for row in rows) / len(rows)


def _summary(rows: Rows) -> str:
    """Largest mean gap of each method over the cycle times."""
    largest: dict[str, float] = {}
    for row in rows:
        if row["method"] not in LEFT_OUT:
            label = key_label(row["method"])
            largest[label] = max(largest.get(label, 0.0), number(row["gap_mean_percent"]))
    return "Largest mean gap of a cycle time: " + ", ".join(f"{label} {gap:.2g} %" for label, gap in largest.items())
