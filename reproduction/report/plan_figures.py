"""Figures of plans: thesis Figures 6.2 and 6.3, sensitivity to the payload."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reproduction.report.drawing import Drawing
from reproduction.report.gap_figures import MARKERS, by_cycle_time, matching, over_cycle_time
from reproduction.report.labels import method_label
from reproduction.report.results import Columns, Results, number
from reproduction.report.tree_figures import example_tree
from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.plots.style import BLUE, GREY, RED, Style

SLOWDOWN_RELAXATION = 121.0  # of Figure 6.2: enough time to slow some motions, not all
COMPARED = ("krc_polynomial", "predicted_three_segment")
SAMPLE_RATE_HZ = 125.0
SHORTEST_WAIT_S = 1e-3  # shorter ones are rounding of the plan


@dataclass(frozen=True)
class DrawnPlan:
    """One plan of one tree, vertices in order; arrays of shape (V,).

    Attributes:
        method: Method with its variant, for people.
        cycle_time_percent: Cycle time as a share of the least one. [%]
        vertices: Names of the vertices.
        columns: Columns of the plan table.
    """

    method: str
    cycle_time_percent: float
    vertices: list[str]
    columns: Columns

    def __getitem__(self, column: str) -> NDArray[Any]:
        return self.columns[column]


def plan_of(results: Results, tree: str, method: str, percent: float) -> DrawnPlan | None:
    """The plan of a method that is nearest to a cycle time; of several variants the one of fewest chords.

    Args:
        results: Results of the stages.
        tree: Experiment tree.
        method: Name of the method in `data/plans.parquet`.
        percent: Cycle time wanted, as a share of the least one. [%]
    """
    rows = results.query(
        # Of two spacings of the profiling runs, take the one that saves more, as the tables do.
        "WITH spacing AS (SELECT p.point_spacing, avg(p.simulated_energy_j / base.simulated_energy_j) AS share"
        " FROM plans AS p JOIN plans AS base USING (tree_id, relaxation_percent, vertex)"
        " WHERE p.method = $2 AND base.method = 'unoptimized' GROUP BY p.point_spacing"
        " ORDER BY share, p.point_spacing DESC LIMIT 1),"
        " chosen AS (SELECT relaxation_percent, krc_segments, plans.point_spacing FROM plans JOIN spacing"
        " ON plans.point_spacing IS NOT DISTINCT FROM spacing.point_spacing WHERE tree_id = $1 AND method = $2"
        " ORDER BY abs(relaxation_percent - $3), relaxation_percent, krc_segments LIMIT 1)"
        " SELECT plans.* FROM plans, chosen WHERE tree_id = $1 AND method = $2"
        " AND plans.relaxation_percent = chosen.relaxation_percent"
        " AND plans.krc_segments IS NOT DISTINCT FROM chosen.krc_segments"
        " AND plans.point_spacing IS NOT DISTINCT FROM chosen.point_spacing ORDER BY vertex",
        tree,
        method,
        percent,
    )
    if not len(rows["vertex"]):
        return None
    segments = rows["krc_segments"][0]
    label = method_label(method, segments if segments == segments else None)  # NaN: no chords
    return DrawnPlan(label, float(rows["relaxation_percent"][0]), [str(name) for name in rows["move"]], rows)


def _plans(results: Results, methods: tuple[str, ...], percent: float) -> list[DrawnPlan]:
    tree = example_tree(results)
    found = [plan_of(results, tree, method, percent) for method in methods]
    plans = [plan for plan in found if plan is not None]
    if not plans:
        raise InputError(f"there are no plans of the tree '{tree}'", file=results.layout.plans)
    return plans


def optimised_trees(results: Results, style: Style) -> Drawing:
    """Figure 6.2: which motions two methods slow down, and how much."""
    plans = _plans(results, COMPARED, SLOWDOWN_RELAXATION)
    figure, (speeds, durations) = style.figure(0.72, 2, 1, sharex=True)
    place = np.arange(len(plans[0].vertices))
    width = 0.8 / len(plans)
    least = np.min([plan["d_min_s"] for plan in plans], axis=0)
    texts = []
    for number_, (plan, color) in enumerate(zip(plans, (BLUE, RED), strict=False)):
        offset = (number_ - (len(plans) - 1) / 2) * width
        speeds.bar(place + offset, plan["speed_limit_percent"], width, color=color, label=plan.method)
        durations.bar(place + offset, plan["duration_s"], width, color=color)
        slowed = plan["duration_s"] > 1.01 * plan["d_min_s"]
        stretch = plan["duration_s"] / np.where(plan["d_min_s"] > 0, plan["d_min_s"], 1.0)
        texts.append(
            f"{plan.method}: {int(slowed.sum())} of {len(slowed)} motions slowed by more than 1 %, the slowest by "
            f"{100 * (stretch.max() - 1):.0f} %"
        )
    durations.hlines(least, place - 0.4, place + 0.4, color="black", linewidth=1.2, label="fastest")
    speeds.set_ylabel("speed limit [%]")
    durations.set_ylabel("duration [s]")
    durations.set_xticks(place, plans[0].vertices, rotation=45, ha="right", fontsize=7)
    durations.legend()
    figure.legend(*speeds.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    for ax in (speeds, durations):
        ax.grid(axis="x", visible=False)
    summary = "; ".join(texts)
    return Drawing(
        figure,
        f"Speed limits and durations of {example_tree(results)} at {plans[0].cycle_time_percent:g} % of the least "
        f"cycle time. {summary}.",
        f"Two bar charts over the movements of one tree, speed limits above and durations below. {summary}.",
    )


def power_over_time(results: Results, style: Style) -> Drawing:
    """Figure 6.3: mains power over one cycle of about twice the least cycle time."""
    largest = float(results.query("SELECT max(relaxation_percent) AS r FROM plans")["r"][0])
    plans = _plans(
        results, ("unoptimized", "predicted_three_segment", "krc_polynomial", "optimum"), min(largest, 200.0)
    )
    tree = example_tree(results)
    motions = results.query(
        'SELECT motion_id, idle_power_start_w, idle_power_end_w FROM motions WHERE tree_id = ? ORDER BY "order"', tree
    )
    paths = results.paths(motions["motion_id"].tolist())
    figure, axes = style.figure(0.26 * len(plans) + 0.06, len(plans), 1, sharex=True, sharey=True, squeeze=False)
    texts = []
    for ax, plan in zip(axes[:, 0], plans, strict=True):
        points, waits = _power_curve(plan, paths, motions)
        ax.fill_between(*points.T, color=BLUE, alpha=0.25, linewidth=0)
        ax.plot(*points.T, color=BLUE, linewidth=0.9)
        for start, end in waits:
            ax.axvspan(start, end, color=GREY, alpha=0.25, linewidth=0)
        waited = sum(end - start for start, end in waits)
        energy = float(plan["simulated_energy_j"][0])
        ax.set_title(f"{plan.method}: {energy:.0f} J, waits {waited:.2f} s", loc="left")
        longest = max(waits, key=lambda wait: wait[1] - wait[0], default=None)
        where = f", the longest from {longest[0]:.1f} to {longest[1]:.1f} s" if longest else ""
        texts.append(f"{plan.method}: {energy:.0f} J, waits {waited:.2f} s in all{where}")
    axes[-1, 0].set_xlabel("time [s]")
    axes[-1, 0].set_ylim(bottom=0)
    figure.supylabel("mains power [W]", fontsize=9)
    summary = "; ".join(texts)
    return Drawing(
        figure,
        f"Mains power over one cycle of {tree} at {plans[0].cycle_time_percent:g} % of the least cycle time; grey: the "
        f"robot waits. {summary}.",
        f"Curves of power over time, one below the other, with waits shaded. {summary}.",
    )


def _power_curve(plan: DrawnPlan, paths: MotionPaths, motions: Columns) -> tuple[Array, list[tuple[float, float]]]:
    """Mains power over one cycle, shape (T, 2) [s, W], and the spans in which the robot waits [s]."""
    time, parts, waits = 0.0, [], []

    def wait(length: float, power_w: float) -> None:
        nonlocal time
        if length > SHORTEST_WAIT_S:
            waits.append((time, time + length))
            parts.append(np.array([[time, power_w], [time + length, power_w]]))
        time += length

    for vertex in range(len(plan.vertices)):
        wait(float(plan["prior_wait_s"][vertex]), float(motions["idle_power_start_w"][vertex]))
        run = paths.sample(vertex, float(plan["speed_limit_percent"][vertex]) / 100.0, SAMPLE_RATE_HZ)
        parts.append(np.column_stack([time + run.time_s, run.power_w]))
        time += float(run.time_s[-1])
        after = float(plan["post_wait_s"][vertex] + plan["collision_wait_s"][vertex])
        wait(after, float(motions["idle_power_end_w"][vertex]))
    return np.concatenate(parts), waits


def payload_sensitivity(results: Results, style: Style) -> Drawing | None:
    """Mean power at full speed and saving of the optimum with other payloads; None if they were not asked for."""
    rows = matching(results.table("payload_sensitivity"), {"method": "optimum"})
    if not rows:
        return None
    payloads = sorted({number(row["payload_kg"]) for row in rows})
    figure, (power, saving) = style.figure(0.5, 1, 2, width_ratios=(1, 2))
    powers, texts = [], []
    for place, (payload, color) in enumerate(zip(payloads, style.colors(len(payloads)), strict=True)):
        here = by_cycle_time([row for row in rows if number(row["payload_kg"]) == payload])
        powers.append(number(here[0]["mean_power_full_speed_w"]))
        power.bar(place, powers[-1], color=color)
        percents, savings_percent = over_cycle_time(here, "saving_percent")
        saving.plot(
            percents,
            savings_percent,
            color=color,
            marker=MARKERS[place % len(MARKERS)],
            markersize=4.5,
            label=f"{payload:g} kg",
        )
        texts.append(
            f"{payload:g} kg: {powers[-1]:.0f} W, saving {savings_percent[0]:.1f} % at {percents[0]:g} % and "
            f"{savings_percent[-1]:.1f} % at {percents[-1]:g} %"
        )
    power.set_xticks(range(len(payloads)), [f"{payload:g}" for payload in payloads])
    power.set(xlabel="payload [kg]", ylabel="mean power at full speed [W]")
    power.grid(axis="x", visible=False)
    saving.set(xlabel="cycle time [% of the least one]", ylabel="saving of the optimum, Eq. 6.1 [%]")
    saving.legend(title="payload")
    summary = "; ".join(texts)
    return Drawing(
        figure,
        "Mean power of the experiment trees at full speed, and energy saving of the proven optimum, with other "
        f"payloads. {summary}.",
        f"Bars of power over payload, and lines of energy saving over cycle time, one per payload. {summary}.",
    )
