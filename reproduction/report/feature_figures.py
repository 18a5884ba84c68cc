"""Figures of features: thesis Figures 4.3 and 4.5-4.7."""

from __future__ import annotations

from functools import partial

import numpy as np

from reproduction.report.drawing import Drawing
from reproduction.report.labels import feature_label
from reproduction.report.results import Results, number
from robojoule.errors import InputError
from robojoule.plots.style import MINUS, Style

BLOCKS = {
    "static": "static features",
    "dynamic_1_3": "dynamic features of joints 1 to 3",
    "dynamic_4_6": "dynamic features of the wrist joints",
}
SHOWN_SHARE = 0.995  # of the motions along the steepness axis
DARK_CELL = 0.6  # |r| above which a cell is so dark that its text is white


def steepness_and_saving(results: Results, style: Style) -> Drawing:
    """Figure 4.3: energy saving over steepness, coloured by the time it takes."""
    rows = results.query(
        "SELECT steepness_j_per_s, energy_saving_j, duration_penalty_s FROM features"
        " WHERE energy_saving_j > 0 ORDER BY motion_id"
    )
    figure, ax = style.figure()
    dots = ax.scatter(
        rows["steepness_j_per_s"],
        rows["energy_saving_j"],
        c=rows["duration_penalty_s"],
        cmap=style.colormap,
        s=6,
        linewidths=0,
        rasterized=True,
    )
    figure.colorbar(dots, ax=ax, label="duration penalty [s]")
    steepness = rows["steepness_j_per_s"]
    shown = 1.05 * float(np.quantile(steepness, SHOWN_SHARE)) if len(steepness) else 1.0
    beyond = int((steepness > shown).sum())
    ax.set(xlim=(0, shown), xlabel="steepness [J/s]", ylabel="simulated energy saving [J]")
    count = len(rows["energy_saving_j"])
    return Drawing(
        figure,
        f"Simulated energy saving over steepness (Eq. 4.1) of {count} motions that save energy by slowing down. The "
        "same steepness is reached with small savings quickly and with large ones later. "
        f"{beyond} of them are beyond the right end, with small savings in very short times.",
        f"Scatter plot of {count} motions in a wedge: savings spread wider the larger the steepness is; colour shows "
        "the duration penalty.",
    )


def correlation_matrix(block: str, results: Results, style: Style) -> Drawing:
    """Figures 4.5 to 4.7: one correlation matrix of `reports/tables/correlations.csv`.

    Args:
        block: static, dynamic_1_3 or dynamic_4_6.
        results: Results of the stages.
        style: Look.
    """
    path = results.layout.tables_dir / "correlations.csv"
    rows = [row for row in results.table("correlations") or [] if row["block"] == block]
    if not rows:
        raise InputError("there are no correlations; run the stage build_features first", file=path, key=block)
    names = list(dict.fromkeys(row["row_feature"] for row in rows))
    place = {name: index for index, name in enumerate(names)}
    matrix = np.full((len(names), len(names)), np.nan)
    for row in rows:
        matrix[place[row["row_feature"]], place[row["column_feature"]]] = number(row["pearson"])
    figure, ax = style.figure(0.86)
    cells = ax.pcolormesh(matrix, cmap="RdBu_r", vmin=-1, vmax=1, edgecolors="white", linewidth=0.4)
    for i, j in np.ndindex(*matrix.shape):
        if np.isfinite(matrix[i, j]):
            color = "white" if abs(matrix[i, j]) > DARK_CELL else "black"
            text = f"{matrix[i, j]:.2f}".replace("0.", ".")
            cell = ax.text(j + 0.5, i + 0.5, text, ha="center", va="center", fontsize=5.4, color=color)
            cell.set_in_layout(False)  # inside the axes: measuring hundreds of them would only take time
    labels = [feature_label(name) for name in names]
    ticks = np.arange(len(names)) + 0.5
    ax.set_xticks(ticks, labels, rotation=90, fontsize=6.5)
    ax.set_yticks(ticks, labels, fontsize=6.5)
    ax.invert_yaxis()
    ax.grid(False)
    figure.colorbar(cells, ax=ax, shrink=0.6, pad=0.01, label="Pearson correlation")
    target = "energy_saving_j"
    strongest = ""
    if target in place:
        others = [
            (abs(r), name)
            for r, name in zip(matrix[place[target]], names, strict=True)
            if name.startswith("j") and np.isfinite(r)
        ]
        if others:
            best = max(others)[1]
            strongest = (
                f" Of the joint features, {feature_label(best)} goes most with the energy saving "
                f"(r = {matrix[place[target], place[best]]:.2f}).".replace("-", MINUS)
            )
    return Drawing(
        figure,
        f"Correlation matrix (Pearson) of the {BLOCKS.get(block, block)} over training and test motions.{strongest}",
        f"Matrix of {len(names)} by {len(names)} cells, red for positive and blue for negative correlation, each with "
        "its value.",
    )


static_correlations = partial(correlation_matrix, "static")
dynamic_correlations_1_3 = partial(correlation_matrix, "dynamic_1_3")
dynamic_correlations_4_6 = partial(correlation_matrix, "dynamic_4_6")
