"""The plan of a cell over one cycle: what each robot does, its power modes, hand-overs, and the power of all robots."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from robojoule.plots.style import BLUE, GREEN, GREY, ORANGE, RED, Style, svg_text

if TYPE_CHECKING:
    from robojoule.planning.cells.plan import CellPlan
    from robojoule.programs.cell import Cell

_MODES = (ORANGE, GREEN, "#6a3fa0", RED)  # standing, by the number of the power mode
_HEIGHT = 0.7  # of a bar, in rows
_NAMED = 8  # robots up to which activities are named in their bars


def drawing_of(cell: Cell, plan: CellPlan) -> str:
    """Draw a plan; the same plan gives the same bytes.

    Args:
        cell: The cell.
        plan: A plan of it, in which every step is known to the cell.

    Returns:
        SVG text.
    """
    style = Style(width_in=9.0)
    with style.applied():
        count = len(cell.robots)
        figure, (upper, lower) = style.figure(0.25 + 0.05 * count, 2, sharex=True, height_ratios=[max(count, 2), 2])
        rows = {robot.name: row for row, robot in enumerate(cell.robots)}
        modes = {(robot.name, mode.name): k for robot in cell.robots for k, mode in enumerate(robot.modes)}
        labels: dict[int, str] = {}
        for robot in cell.robots:
            for k, mode in enumerate(robot.modes):
                labels.setdefault(k, mode.label or f"mode {mode.name}")
        for step in plan.steps:
            color = BLUE if step.mode is None else _MODES[modes[step.robot, step.mode] % len(_MODES)]
            for start, length in step.parts(cell.cycle_time_s):
                upper.barh(rows[step.robot], length, left=start, height=_HEIGHT, color=color, edgecolor="white", lw=0.4)
        if count <= _NAMED:
            _name(upper, plan, rows, cell.cycle_time_s)
        _connect(upper, cell, plan, rows)
        upper.set_yticks(range(count), [robot.name for robot in cell.robots])
        upper.invert_yaxis()
        upper.set_title(f"{cell.name}: {plan.energy_j:.0f} J per cycle of {cell.cycle_time_s:g} s")
        upper.grid(axis="y", visible=False)
        for k in sorted({modes[step.robot, step.mode] for step in plan.steps if step.mode is not None}):
            upper.bar(0.0, 0.0, color=_MODES[k % len(_MODES)], label=f"stands, {labels[k]}")
        upper.bar(0.0, 0.0, color=BLUE, label="moves")
        time, power = plan.powers_w()
        lower.step(time, power, where="post", color=BLUE, linewidth=1.2)
        lower.axhline(plan.energy_j / cell.cycle_time_s, color=GREY, linewidth=0.8, linestyle="--", label="mean")
        lower.set(xlabel="time in the cycle [s]", ylabel="power [W]", xlim=(0.0, cell.cycle_time_s))
        lower.set_ylim(bottom=0.0)
        figure.legend(loc="outside lower center", ncols=5)
        return svg_text(figure)


def _name(axes: Any, plan: CellPlan, rows: dict[str, int], cycle_time_s: float) -> None:
    """Names of the activities in bars that are long enough for them."""
    for step in plan.steps:
        start, length = max(step.parts(cycle_time_s), key=lambda part: part[1], default=(0.0, 0.0))
        if length > 0.011 * len(step.activity) * cycle_time_s:
            text = {"ha": "center", "va": "center", "fontsize": 6.0, "color": "white", "clip_on": True}
            axes.text(start + length / 2.0, rows[step.robot], step.activity, **text)


def _connect(axes: Any, cell: Cell, plan: CellPlan, rows: dict[str, int]) -> None:
    """An arrow for each hand-over, from what comes first in the cycle to what comes next."""
    steps = {step.activity: step for step in plan.steps}
    for handover in cell.handovers:
        if handover.first not in steps or handover.second not in steps:
            continue
        a, b = steps[handover.first], steps[handover.second]
        if (b.start_s - a.start_s) % cell.cycle_time_s > 0.5 * cell.cycle_time_s:
            a, b = b, a
        start = (a.start_s + a.duration_s) % cell.cycle_time_s
        end = b.start_s % cell.cycle_time_s
        if end >= start:  # not over the end of the cycle
            style = {"arrowstyle": "->", "color": "black", "linewidth": 0.9}
            axes.annotate("", (end, rows[b.robot]), (start, rows[a.robot]), arrowprops=style)
