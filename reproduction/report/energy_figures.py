"""Where the energy goes: parts of the energy over duration, and of whole trees at full speed."""

from __future__ import annotations

import numpy as np

from reproduction.report.drawing import Drawing
from reproduction.report.profile_figures import typical_motion
from reproduction.report.results import Results
from robojoule.plots.style import ENERGY_PARTS, MINUS, Style, stacked_over_duration, used_parts

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
    changes = {part: rows[part][best] - rows[part][0] for part in used_parts(rows)}
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


def breakdown_of_trees(results: Results, style: Style) -> Drawing:
    """Parts of the energy of every experiment tree at full speed, one bar a tree."""
    sums = ", ".join(f"sum({part} ORDER BY motion_id) AS {part}" for part in ("energy_j", *ENERGY_PARTS))
    rows = results.query(
        f"SELECT tree_id, {sums} FROM runs JOIN motions USING (motion_id) WHERE split = 'experiment' AND"
        " speed_limit_percent = (SELECT max(speed_limit_percent) FROM runs) GROUP BY tree_id ORDER BY tree_id"
    )
    figure, ax = style.figure(0.62)
    names, parts = [str(name) for name in rows["tree_id"]], used_parts(rows)
    place = np.arange(len(names))
    positive, negative = np.zeros(len(names)), np.zeros(len(names))
    for part, color in zip(parts, style.colors(len(parts)), strict=True):
        values = rows[part]
        ax.bar(place, values, bottom=np.where(values >= 0, positive, negative), color=color, label=ENERGY_PARTS[part])
        positive, negative = positive + np.maximum(values, 0.0), negative + np.minimum(values, 0.0)
    if len(names) <= LABELLED_TREES:
        ax.set_xticks(place, [name.rpartition("-")[2] for name in names], fontsize=7)
    ax.set(xlabel="experiment tree", ylabel="energy of a cycle at full speed [J]")
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
