"""The energy model held against the published figures: what the fit aimed at, and what it did not."""

from __future__ import annotations

from dataclasses import dataclass

from reproduction.claims import verdict
from reproduction.tables import Row


@dataclass(frozen=True)
class PublishedFigure:
    """A figure that the thesis gives, and within which bounds the model is called credible.

    Attributes:
        metric: Name in the metrics of the energy model.
        figure: What it is.
        published: What the thesis says.
        low: Least credible value.
        high: Largest credible value.
        fitted: Whether the drive parameters were fitted on it.
    """

    metric: str
    figure: str
    published: str
    low: float
    high: float
    fitted: bool


PUBLISHED_FIGURES = (
    PublishedFigure("idle_power_home_w", "idle power at HOME [W]", "430", 417.1, 442.9, True),
    PublishedFigure("mean_power_full_speed_w", "mean power at full speed [W]", "1466", 1363.4, 1568.6, True),
    PublishedFigure("min_tree_power_full_speed_w", "least tree power at full speed [W]", "1137", 1050, 1950, True),
    PublishedFigure("max_tree_power_full_speed_w", "largest tree power at full speed [W]", "1822", 1050, 1950, True),
    PublishedFigure("duration_ratio_slowest_to_fastest", "duration at 10 % over 100 %, median", "6.0", 4, 6.5, True),
    PublishedFigure("optimum_inside_percent", "profiles with the optimum inside [%]", "most", 95, 100, True),
    PublishedFigure("rising_linear_r2", "R2 of a line through the rising part, median", "linear", 0.99, 1, True),
    PublishedFigure("rising_slope_over_idle", "rising slope over idle power, median", "1.37", 0.8, 1.4, True),
    PublishedFigure("example_motion_deviation", "nearest motion to the example, deviation", "0", 0, 0.10, True),
    PublishedFigure("idle_power_min_w", "least idle power at the trees' points [W]", "430", 430, 450, False),
    PublishedFigure("idle_power_max_w", "largest idle power at the trees' points [W]", "450", 430, 450, False),
)


def energy_model_rows(metrics: dict[str, float]) -> list[Row]:
    """The published figures, one row each: figure, published, bounds, robojoule, fitted or not, held or not."""
    return [
        {
            "figure": item.figure,
            "published": item.published,
            "low": item.low,
            "high": item.high,
            "robojoule": round(metrics[item.metric], 4),
            "fitted": verdict(item.fitted),
            "held": verdict(item.low <= metrics[item.metric] <= item.high),
        }
        for item in PUBLISHED_FIGURES
    ]
