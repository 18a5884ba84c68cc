"""Figures of the predictors: thesis Figures 5.1-5.4."""

from __future__ import annotations

from functools import partial
from typing import Any, Protocol

import numpy as np

from reproduction.methods.three_segment_profile import ThreeSegmentShape, three_segment_profile
from reproduction.predictors.evaluation import outliers
from reproduction.report.drawing import Drawing, spread
from reproduction.report.labels import MODELS, TARGETS
from reproduction.report.results import Columns, Results
from robojoule.plots.style import BLUE, OVER, RED, UNDER, Style
from robojoule.profile.sampled import SampledProfile

EXAMPLES = 6


class ProfileSource(Protocol):
    """Knows the simulated runs of motions, as `Results` does."""

    def profile(self, motion_id: int) -> SampledProfile:
        """Distinct runs of a motion."""
        ...


def predicted_against_measured(predictions: Columns, target: str, style: Style) -> Drawing:
    """Predicted over measured values of one target, one plot a model.

    Args:
        predictions: Columns model, `target`, `target`_measured; N rows.
        target: energy_saving_j, optimal_duration_s or energy_penalty_j.
        style: Look.
    """
    models = sorted(set(predictions["model"].tolist()), key=lambda model: (list(MODELS).index(model), model))
    label, unit = TARGETS[target]
    figure, axes = style.figure(0.56 if len(models) > 1 else 0.7, 1, len(models), squeeze=False, sharey=True)
    texts = []
    values = np.concatenate([predictions[target], predictions[f"{target}_measured"]])
    top = 1.03 * float(values.max(initial=0.0)) or 1.0
    for ax, model in zip(axes[0], models, strict=True):
        rows = predictions["model"] == model
        measured, predicted = predictions[f"{target}_measured"][rows], predictions[target][rows]
        side = outliers(predicted, measured)
        under, over = side < 0, side > 0
        for chosen, color, name in (
            (side == 0, BLUE, "near the diagonal"),
            (under, UNDER, "underpredicted"),
            (over, OVER, "overpredicted"),
        ):
            ax.scatter(
                measured[chosen],
                predicted[chosen],
                s=7,
                color=color,
                linewidths=0,
                rasterized=True,
                label=f"{name} ({int(chosen.sum())})",
            )
        ax.plot([0, top], [0, top], color="black", linewidth=0.8)
        ax.set(xlim=(0, top), ylim=(0, top), aspect="equal", title=MODELS[model], xlabel=f"measured [{unit}]")
        ax.legend(loc="upper left", markerscale=1.8, handletextpad=0.2)
        texts.append(
            f"{MODELS[model]}: {int(under.sum())} under- and {int(over.sum())} overpredicted of {int(rows.sum())}"
        )
    axes[0, 0].set_ylabel(f"predicted [{unit}]")
    summary = "; ".join(texts)
    return Drawing(
        figure,
        f"Predicted against measured {label} of held-out motions. Outliers (the residual lies more than 1.5 "
        f"interquartile ranges outside its quartiles) are red or orange: {summary}.",
        f"Scatter plots of predicted over measured {label}, one a model, along the diagonal; outliers: {summary}.",
    )


def _held_out(target: str, results: Results, style: Style) -> Drawing:
    rows = results.query(
        f"SELECT model, {target}, {target}_measured FROM predictions WHERE split = 'test' ORDER BY model, motion_id"
    )
    return predicted_against_measured(rows, target, style)


predicted_saving = partial(_held_out, "energy_saving_j")
predicted_duration = partial(_held_out, "optimal_duration_s")
predicted_penalty = partial(_held_out, "energy_penalty_j")


def predicted_profiles(results: Results, style: Style) -> Drawing:
    """Figure 5.4: predicted three-segment profiles over measured ones, both with their minimum at the offset."""
    rows = results.query(
        "SELECT motion_id, p.energy_saving_j, p.optimal_duration_s, p.energy_penalty_j, duration_fastest_s,"
        " duration_slowest_s FROM predictions AS p JOIN features USING (motion_id)"
        " WHERE p.split = 'test' AND model = 'random_forest' AND duration_slowest_s > duration_fastest_s"
        " ORDER BY abs(p.energy_saving_j - energy_saving_j_measured) / (energy_saving_j_measured + 1), motion_id"
    )
    return overlapping_profiles(rows, results, style, results.shape)


def overlapping_profiles(rows: Columns, profiles: ProfileSource, style: Style, shape: ThreeSegmentShape) -> Drawing:
    """Draw some predicted profiles over their measured ones, from the best to the worst predicted saving.

    Args:
        rows: Predicted and true figures of N motions, best prediction first.
        profiles: Where the measured runs come from.
        style: Look.
        shape: Constants of the three-segment profile.
    """
    places = spread(len(rows["motion_id"]), EXAMPLES)
    figure, axes = style.figure(0.62, 2, 3, squeeze=False)
    for ax, place in zip(axes.flat, places, strict=False):
        _draw_pair(ax, {name: values[place] for name, values in rows.items()}, profiles, shape)
    for ax in axes.flat[len(places) :]:
        ax.set_axis_off()
    if places:
        axes[0, 0].legend(fontsize=7)
    figure.supxlabel("duration [s]", fontsize=9)
    figure.supylabel("energy less minimum, plus offset [J]", fontsize=9)
    return Drawing(
        figure,
        f"Predicted three-segment profiles (random forest) and measured runs of {len(places)} held-out motions, both "
        f"moved to a minimum of {shape.offset_j:g} J; from the best predicted energy saving (top left) to the worst "
        "(bottom right) in equal steps of rank.",
        f"{len(places)} small plots: three straight lines (falling, level, rising) over dots of measured runs.",
    )


def _draw_pair(ax: Any, row: dict[str, Any], profiles: ProfileSource, shape: ThreeSegmentShape) -> None:
    measured = profiles.profile(row["motion_id"])
    predicted, _ = three_segment_profile(
        float(row["duration_fastest_s"]),
        float(row["optimal_duration_s"]),
        float(row["duration_slowest_s"]),
        float(row["energy_saving_j"]),
        float(row["energy_penalty_j"]),
        shape,
    )
    ax.plot(
        measured.durations_s,
        measured.energies_j - np.min(measured.energies_j) + shape.offset_j,
        "o",
        color=RED,
        markersize=4,
        label="measured",
    )
    ax.plot(predicted.durations_s, predicted.energies_j, color=BLUE, label="predicted")
    ax.set_title(f"motion {row['motion_id']}", fontsize=8)
