"""Gaps of methods to the optimum: means with confidence intervals, worst trees, wins and losses against each other."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from reproduction.tables import Row
from robojoule.arrays import Array

RESAMPLES = 2000
CONFIDENCE = 0.95
_TIE = 1e-6  # relative difference of energies that counts as equal


@dataclass(frozen=True)
class PlanEnergies:
    """Energies of plans on the plant.

    Attributes:
        cycle_times_percent: R cycle times as shares of the least one. [%]
        energy_j: Method -> energies of its cycles, shape (T, R). [J]
    """

    cycle_times_percent: tuple[float, ...]
    energy_j: dict[str, Array]

    def gaps_percent(self, method: str) -> Array:
        """Gap to the optimum, shape (T, R). [%]"""
        best = self.energy_j["optimum"]
        return np.asarray(100.0 * (self.energy_j[method] - best) / best)


def gap_rows(plans: PlanEnergies, key: Row, groups: Iterable[int] | None = None) -> list[Row]:
    """One row per method and cycle time.

    Args:
        plans: Energies of all methods.
        key: Leading columns.
        groups: Group of each tree (robots); confidence intervals resample groups then, trees otherwise.
    """
    rows: list[Row] = []
    for r, percent in enumerate(plans.cycle_times_percent):
        unoptimized = plans.energy_j["unoptimized"][:, r]
        for method, energies in plans.energy_j.items():
            gap = plans.gaps_percent(method)[:, r]
            low, high = bootstrap_mean(gap, groups)
            energy = energies[:, r]
            rows.append(
                key
                | {
                    "relaxation_percent": f"{percent:g}",
                    "method": method,
                    "gap_mean_percent": round(float(gap.mean()), 4),
                    "gap_low_percent": round(low, 4),
                    "gap_high_percent": round(high, 4),
                    "gap_worst_percent": round(float(gap.max()), 4),
                    "saving_mean_percent": round(float((100.0 * (1.0 - energy / unoptimized)).mean()), 4),
                    "above_unoptimized_percent": round(float(100.0 * (energy > unoptimized * (1 + _TIE)).mean()), 2),
                    "trees": len(gap),
                }
            )
    return rows


def win_rows(plans: PlanEnergies, key: Row) -> list[Row]:
    """Wins and losses of each method against each other one, over trees: one row per pair and cycle time."""
    rows: list[Row] = []
    for r, percent in enumerate(plans.cycle_times_percent):
        for method, own in plans.energy_j.items():
            for other, theirs in plans.energy_j.items():
                if method == other:
                    continue
                ratio = own[:, r] / theirs[:, r] - 1.0
                rows.append(
                    key
                    | {
                        "relaxation_percent": f"{percent:g}",
                        "method": method,
                        "other": other,
                        "wins": int((ratio < -_TIE).sum()),
                        "losses": int((ratio > _TIE).sum()),
                        "trees": len(ratio),
                    }
                )
    return rows


def bootstrap_mean(values: Array, groups: Iterable[int] | None = None) -> tuple[float, float]:
    """Percentile bootstrap interval of a mean; whole groups are drawn where groups are given."""
    rng = np.random.default_rng(1)
    labels = np.arange(len(values)) if groups is None else np.asarray(list(groups))
    _, label = np.unique(labels, return_inverse=True)
    totals, counts = np.bincount(label, values), np.bincount(label)
    drawn = rng.integers(0, len(totals), (RESAMPLES, len(totals)))
    means = totals[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    low, high = np.quantile(means, [(1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0])
    return float(low), float(high)
