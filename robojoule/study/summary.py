"""Tables of the studies: errors of profile parameters, gaps to the optimum with confidence intervals."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from robojoule.drive import Array
from robojoule.predictor.evaluation import error_rows
from robojoule.predictor.profile_parameters import TARGETS
from robojoule.study.plans import PlanEnergies

Row = dict[str, object]
RESAMPLES = 2000
CONFIDENCE = 0.95
_TIE = 1e-6  # relative difference of energies that counts as equal


def parameter_rows(predicted: Array, truth: Array, key: Row) -> list[Row]:
    """Relative errors of the three parameters: one row a target.

    Args:
        predicted: Shape (M, 3).
        truth: Shape (M, 3).
        key: Leading columns.
    """
    moving = truth[:, 1] > 0.0
    rows = []
    for found in error_rows(predicted[moving], truth[moving]):
        if found.error == "rel_percent":
            figures = {name: round(getattr(found, name), 4) for name in ("p25", "p50", "p75", "max", "mean")}
            rows.append(
                key
                | {"target": found.target}
                | {f"rel_{name}_percent": value for name, value in figures.items()}
                | {"motions": found.motions, "zeros_left_out": found.zeros_left_out}
            )
    return sorted(rows, key=lambda row: TARGETS.index(str(row["target"])))


def gap_rows(plans: PlanEnergies, key: Row, groups: Iterable[int] | None = None) -> list[Row]:
    """One row a method and relaxation.

    Args:
        plans: Energies of all methods.
        key: Leading columns.
        groups: Group of each tree (robots); confidence intervals resample groups then, trees otherwise.
    """
    rows: list[Row] = []
    for r, relaxation in enumerate(plans.relaxations_percent):
        unoptimized = plans.energy_j["unoptimized"][:, r]
        for method, energies in plans.energy_j.items():
            gap = plans.gaps_percent(method)[:, r]
            low, high = bootstrap_mean(gap, groups)
            energy = energies[:, r]
            rows.append(
                key
                | {
                    "relaxation_percent": relaxation,
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
    """Wins and losses of each method against each other one, over trees: one row a pair and relaxation."""
    rows: list[Row] = []
    for r, relaxation in enumerate(plans.relaxations_percent):
        for method, ours in plans.energy_j.items():
            for other, theirs in plans.energy_j.items():
                if method == other:
                    continue
                ratio = ours[:, r] / theirs[:, r] - 1.0
                rows.append(
                    key
                    | {
                        "relaxation_percent": relaxation,
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


def median_rows(errors: list[Row]) -> list[Row]:
    """Medians and quartiles over robots of each robot's median error: one row a model, grid and target."""
    keys = list(dict.fromkeys((row["model"], row["grid"], row["target"]) for row in errors))
    rows: list[Row] = []
    for key in keys:
        found = [row for row in errors if (row["model"], row["grid"], row["target"]) == key]
        medians = np.array([float(str(row["rel_p50_percent"])) for row in found])
        low, middle, high = np.quantile(medians, [0.25, 0.5, 0.75])
        rows.append(
            dict(zip(("model", "grid", "target"), key, strict=True))
            | {
                "rel_p50_median_percent": round(float(middle), 4),
                "rel_p50_p25_percent": round(float(low), 4),
                "rel_p50_p75_percent": round(float(high), 4),
                "robots": len(found),
            }
        )
    return rows
