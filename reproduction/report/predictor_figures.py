"""Figures of the predictors: thesis Figures 5.1-5.4."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from reproduction.methods.three_segment_profile import three_segments
from reproduction.predictors.evaluation import outliers
from reproduction.report.drawing import Drawing, spread
from reproduction.report.labels import MODELS, TARGETS
from reproduction.report.results import Results
from robojoule.plots.style import BLUE, OVER, RED, UNDER, Style

EXAMPLES = 6


def predicted_against_simulated(
    target: str, results: Results, style: Style, wanted: Sequence[str] = tuple(MODELS)
) -> Drawing:
    """Figures 5.1 to 5.3: predicted over simulated values of one target for held-out motions, one plot per model.

    Args:
        target: energy_saving_j, optimal_duration_s or energy_penalty_j.
        results: Results of the stages.
        style: Look.
        wanted: Models.
    """
    predictions = results.query(
        f"SELECT model, {target}, {target}_simulated FROM predictions WHERE split = 'test' AND list_contains(?, model)"
        " ORDER BY model, motion_id",
        list(wanted),
    )
    models = sorted(set(predictions["model"].tolist()), key=lambda model: (list(MODELS).index(model), model))
    label, unit = TARGETS[target]
    figure, axes = style.figure(0.48 if len(models) > 1 else 0.8, 1, len(models), squeeze=False, sharey=True)
    texts = []
    values = np.concatenate([predictions[target], predictions[f"{target}_simulated"]])
    top = 1.03 * float(values.max(initial=0.0)) or 1.0
    for ax, model in zip(axes[0], models, strict=True):
        rows = predictions["model"] == model
        simulated, predicted = predictions[f"{target}_simulated"][rows], predictions[target][rows]
        side = outliers(predicted, simulated)
        under, over = side < 0, side > 0
        for chosen, color, name in (
            (side == 0, BLUE, "near the diagonal"),
            (under, UNDER, "predicted too low"),
            (over, OVER, "predicted too high"),
        ):
            ax.scatter(
                simulated[chosen],
                predicted[chosen],
                s=7,
                color=color,
                linewidths=0,
                rasterized=True,
                label=name if ax is axes[0, 0] else None,
            )
        ax.plot([0, top], [0, top], color="black", linewidth=0.8)
        ax.set(xlim=(0, top), ylim=(0, top), aspect="equal", title=MODELS[model], xlabel=f"simulated [{unit}]")
        texts.append(
            f"{MODELS[model]}: {int(under.sum())} under- and {int(over.sum())} overpredicted of {int(rows.sum())}"
        )
    axes[0, 0].set_ylabel(f"predicted [{unit}]")
    figure.legend(loc="outside lower center", ncols=3, markerscale=1.8, handletextpad=0.2)
    summary = "; ".join(texts)
    return Drawing(
        figure,
        f"Predicted against simulated {label} of held-out motions. Outliers (the residual lies more than 1.5 "
        f"interquartile ranges outside its quartiles) are red or orange: {summary}.",
        f"Scatter plots of predicted over simulated {label}, one per model, along the diagonal; outliers: {summary}.",
    )


predicted_saving = partial(predicted_against_simulated, "energy_saving_j")
predicted_duration = partial(predicted_against_simulated, "optimal_duration_s")
predicted_penalty = partial(predicted_against_simulated, "energy_penalty_j")


def predicted_profiles(results: Results, style: Style, model: str = "random_forest") -> Drawing:
    """Figure 5.4: predicted three-segment profiles over simulated ones, both with their minimum at the offset.

    Some motions are shown, from the best to the worst predicted saving.
    """
    rows = results.query(
        "SELECT motion_id, p.energy_saving_j, p.optimal_duration_s, p.energy_penalty_j, duration_fastest_s,"
        " duration_slowest_s FROM predictions AS p JOIN features USING (motion_id)"
        " WHERE p.split = 'test' AND model = ? AND duration_slowest_s > duration_fastest_s"
        " ORDER BY abs(p.energy_saving_j - energy_saving_j_simulated) / (energy_saving_j_simulated + 1), motion_id",
        model,
    )
    places = spread(len(rows["motion_id"]), EXAMPLES)
    figure, axes = style.figure(0.62, 2, 3, squeeze=False)
    for ax, place in zip(axes.flat, places, strict=False):
        _draw_pair(ax, {name: values[place] for name, values in rows.items()}, results)
    for ax in axes.flat[len(places) :]:
        ax.set_axis_off()
    if places:
        axes[0, 0].legend(fontsize=7)
    figure.supxlabel("duration [s]", fontsize=9)
    figure.supylabel("energy less minimum, plus offset [J]", fontsize=9)
    return Drawing(
        figure,
        f"Predicted three-segment profiles ({MODELS[model]}) and simulated runs of {len(places)} held-out motions, "
        f"both moved to a minimum of {results.shape.offset_j:g} J; from the best predicted energy saving (top left) to "
        "the worst (bottom right) in equal steps of rank.",
        f"{len(places)} small plots: three straight lines (falling, level, rising) over dots of simulated runs.",
    )


def _draw_pair(ax: Any, row: dict[str, Any], results: Results) -> None:
    simulated = results.profile(row["motion_id"])
    predicted, _ = three_segments(
        float(row["duration_fastest_s"]),
        float(row["optimal_duration_s"]),
        float(row["duration_slowest_s"]),
        float(row["energy_saving_j"]),
        float(row["energy_penalty_j"]),
        results.shape,
    )
    ax.plot(
        simulated.durations_s,
        simulated.energies_j - np.min(simulated.energies_j) + results.shape.offset_j,
        "o",
        color=RED,
        markersize=4,
        label="simulated",
    )
    ax.plot(predicted.durations_s, predicted.energies_j, color=BLUE, label="predicted")
    ax.set_title(f"motion {row['motion_id']}", fontsize=8)
