"""The energy model held against the published figures: what the fit aimed at, and what it did not."""

from __future__ import annotations

from reproduction.claims import verdict
from reproduction.reference_robot.setup import fit_setup
from reproduction.tables import Row

FIGURE_COLUMNS = ("figure", "published", "low", "high", "robojoule", "fitted", "held")


def energy_model_rows(metrics: dict[str, float]) -> list[Row]:
    """The published figures, one row each: figure, published, bounds, robojoule, fitted or not, held or not."""
    return [
        {
            "figure": item.figure,
            "published": item.published,
            "low": item.bounds[0],
            "high": item.bounds[1],
            "robojoule": round(metrics[name], 4),
            "fitted": verdict(item.weight > 0.0),
            "held": verdict(item.bounds[0] <= metrics[name] <= item.bounds[1]),
        }
        for name, item in fit_setup().figures.items()
    ]
