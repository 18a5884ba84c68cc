"""Where the energy goes: parts of the energy over duration, and of whole trees at full speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robojoule.report.drawing import Drawing
from robojoule.report.labels import ENERGY_PARTS, MINUS
from robojoule.report.profile_figures import typical_motion
from robojoule.report.results import Columns, Results
from robojoule.report.style import Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LABELLED_TREES = 40  # more bars than this leave no room for names


def breakdown_over_duration(results: Results, style: Style) -> Drawing:
    """Parts of the energy of one motion over its duration, stacked; the motion of Figure 4.2."""
    motion = typical_motion(results)
    rows = results.query(
        f"SELECT duration_s, energy_j, {', '.join(ENERGY_PARTS)} FROM runs"
        ' WHERE motion_id = ? AND "distinct" ORDER BY duration_s',
        motion,
    )
    figure = stacked_over_duration(rows, style)
    best = int(np.argmin(rows["energy_j"]))
    changes = {part: rows[part][best] - rows[part][0] for part in _used(rows)}
    change = ", ".join(
        f"{ENERGY_PARTS[part]} {value:+.0f} J".replace("-", MINUS)
        for part, value in changes.items()
        if abs(value) >= 0.5
    )
    return Drawing(
        figure,
        f"Where the energy of motion {motion} goes, from the fastest to the slowest run. From the fastest run to the "
        f"best one: {change}. Beyond it the base consumption outgrows all else.",
        "Stacked areas of energy parts over duration; the base consumption grows in proportion to it. From the fastest "
        f"run to the best one: {change}.",
    )


def stacked_over_duration(rows: Columns, style: Style) -> Figure:
    """Parts of one motion's energy, stacked.

    Args:
        rows: `duration_s` (rising), `energy_j` and the parts, each of shape (S,).
        style: Look of the figure.
    """
    figure, ax = style.figure(0.64)
    duration, parts = rows["duration_s"], _used(rows)
    # Energy gained by going down is drawn below zero, so that the stack ends at the sum.
    positive, negative = np.zeros_like(duration), np.zeros_like(duration)
    for part, color in zip(parts, style.colors(len(parts)), strict=True):
        gain, loss = np.minimum(rows[part], 0.0), np.maximum(rows[part], 0.0)
        ax.fill_between(duration, positive, positive + loss, color=color, linewidth=0, label=ENERGY_PARTS[part])
        ax.fill_between(duration, negative, negative + gain, color=color, linewidth=0)
        positive, negative = positive + loss, negative + gain
    ax.plot(duration, rows["energy_j"], "o-", color="black", markersize=3, linewidth=1.0, label="sum: mains energy")
    ax.set_xlabel("duration [s]")
    ax.set_ylabel("energy [J]")
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def breakdown_of_trees(results: Results, style: Style) -> Drawing:
    """Parts of the energy of every experiment tree at full speed, one bar a tree."""
    sums = ", ".join(f"sum({part} ORDER BY motion_id) AS {part}" for part in ("energy_j", *ENERGY_PARTS))
    rows = results.query(
        f"SELECT tree_id, {sums} FROM runs JOIN motions USING (motion_id) WHERE split = 'experiment' AND"
        " speed_limit_percent = (SELECT max(speed_limit_percent) FROM runs) GROUP BY tree_id ORDER BY tree_id"
    )
    figure, ax = style.figure(0.62)
    names, parts = [str(name) for name in rows["tree_id"]], _used(rows)
    place = np.arange(len(names))
    positive, negative = np.zeros(len(names)), np.zeros(len(names))
    for part, color in zip(parts, style.colors(len(parts)), strict=True):
        values = rows[part]
        ax.bar(place, values, bottom=np.where(values >= 0, positive, negative), color=color, label=ENERGY_PARTS[part])
        positive, negative = positive + np.maximum(values, 0.0), negative + np.minimum(values, 0.0)
    if len(names) <= LABELLED_TREES:
        ax.set_xticks(place, [name.rpartition("-")[2] for name in names], fontsize=7)
    ax.set_xlabel("experiment tree")
    ax.set_ylabel("energy of a cycle at full speed [J]")
    ax.grid(axis="x", visible=False)
    figure.legend(loc="outside upper center", ncols=min(len(parts), 4))
    total = float(rows["energy_j"].sum())
    shares = ", ".join(f"{ENERGY_PARTS[part]} {100 * rows[part].sum() / total:.0f} %" for part in parts)
    return Drawing(
        figure,
        f"Energy of one cycle at full speed without waits, {len(names)} experiment trees. Shares of the total: "
        f"{shares}. The change of height sums to zero over a closed cycle but for rounding.",
        f"Stacked bars, one for each of {len(names)} trees. Shares of the total energy: {shares}.",
    )


def _used(rows: Columns) -> list[str]:
    """Parts that the energy model uses: a constant drive-active power, for one, may be zero."""
    return [part for part in ENERGY_PARTS if np.abs(rows[part]).max(initial=0.0) > 1e-6]
