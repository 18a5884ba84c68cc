"""What the thesis's chapter 5 says of its predictors, beside what comes out here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pyarrow as pa

from reproduction.claims import Claim
from reproduction.tables import columns
from robojoule.profile.parameters import TARGETS

Metrics = Mapping[str, Mapping[str, Mapping[str, float]]]

_NAMES = dict(zip(TARGETS, ("energy saving", "optimal duration", "energy penalty"), strict=True))
_MEDIANS = dict(zip(TARGETS, (10.4, 4.5, 4.8), strict=True))  # Table 5.1, relative error [%]
_MEANS = dict(zip(TARGETS, (18.5, 6.0, 5.0), strict=True))
_SIMILAR = 1.25  # two median errors are similar where the larger is at most a quarter above the smaller


def predictor_claims(predictions: pa.Table, metrics: Metrics) -> list[Claim]:
    """Claims about predictors: their errors, and where they are large.

    Args:
        predictions: Columns model, split, `TARGETS` and `TARGETS` + `_simulated`, N rows.
        metrics: target -> model -> figure, see `reports/metrics/predictors.json`.
    """
    claims = []
    for target, name in _NAMES.items():
        claims.append(_at_most(f"Median relative error of the {name}, random forest", _MEDIANS, "p50", target, metrics))
    for target, name in _NAMES.items():
        claim = _at_most(f"Mean relative error of the {name}, random forest", _MEANS, "mean", target, metrics)
        if target == TARGETS[0]:
            above = _mean_above(predictions, 1.0)
            claim = replace(claim, robojoule=f"{claim.robojoule}; forest over savings of 1 J and more: {above:.1f} %")
        claims.append(claim)
    claims += [_hardest(metrics), _similar(metrics), _within_tenth(predictions), *_sizes(predictions)]
    forest = metrics["suitability"].get("random_forest", {})
    network = metrics["suitability"].get("neural_network", {})
    if "spearman_mean" in forest and "spearman_mean" in network:
        claims.append(
            Claim(
                "The predicted order of suitability within a tree follows the simulated one",
                "consistent (no figure; taken as a mean Spearman correlation above 0.8)",
                f"{forest['spearman_mean']:.2f} (forest), {network['spearman_mean']:.2f} (network)",
                forest["spearman_mean"] > 0.8,
            )
        )
    return claims


def _at_most(claim: str, published: Mapping[str, float], figure: str, target: str, metrics: Metrics) -> Claim:
    error = metrics[target]["random_forest"].get(f"rel_{figure}_percent", float("nan"))
    network = metrics[target]["neural_network"].get(f"rel_{figure}_percent", float("nan"))
    return Claim(
        claim,
        f"{published[target]:g} %",
        f"{error:.1f} % (network {network:.1f} %)",
        error <= published[target],
    )


def _mean_above(predictions: pa.Table, least_j: float) -> float:
    """Mean relative error of the forest's saving where the simulated one is not tiny. [%]"""
    predicted, simulated = _forest_on_test(predictions, TARGETS[0])
    counted = simulated >= least_j
    if not counted.any():
        return float("nan")
    return float(np.mean(100.0 * np.abs(predicted - simulated)[counted] / simulated[counted]))


def _hardest(metrics: Metrics) -> Claim:
    medians = {name: metrics[target]["random_forest"].get("rel_p50_percent", 0.0) for target, name in _NAMES.items()}
    ranked = sorted(medians, key=lambda name: -medians[name])
    return Claim(
        "Order of the targets by median relative error, largest first",
        "energy saving, energy penalty, optimal duration",
        ", ".join(ranked),
        ranked == ["energy saving", "energy penalty", "optimal duration"],
    )


def _similar(metrics: Metrics) -> Claim:
    pairs = {
        name: [metrics[target][model].get("rel_p50_percent", 0.0) for model in ("random_forest", "neural_network")]
        for target, name in _NAMES.items()
    }
    return Claim(
        "Random forest and neural network are similarly accurate (median relative errors)",
        "similar (taken as within a quarter)",
        "; ".join(f"{name} {forest:.1f} against {network:.1f} %" for name, (forest, network) in pairs.items()),
        all(max(pair) <= _SIMILAR * min(pair) for pair in pairs.values()),
    )


def _within_tenth(predictions: pa.Table) -> Claim:
    predicted, simulated = _forest_on_test(predictions, TARGETS[1])
    share = 100.0 * float((np.abs(predicted - simulated) <= 0.1 * simulated).mean())
    return Claim(
        "Optimal durations within 10 % of the true value, random forest",
        "vast majority (taken as 80 % or more)",
        f"{share:.0f} %",
        share >= 80.0,
    )


def _sizes(predictions: pa.Table) -> list[Claim]:
    """Where the large errors lie, for the energy saving."""
    predicted, simulated = _forest_on_test(predictions, TARGETS[0])
    error = np.abs(predicted - simulated)
    counted = simulated > 0
    if not counted.any():
        return []
    relative = error[counted] / simulated[counted]
    small = float(np.median(simulated[counted][relative >= np.quantile(relative, 0.9)]))
    large = float(np.median(simulated[error >= np.quantile(error, 0.9)]))
    middle = float(np.median(simulated))
    return [
        Claim(
            "Large relative errors of the energy saving occur for small savings",
            "small values",
            f"median saving {small:.0f} J in the worst tenth, {middle:.0f} J in all",
            small < middle,
        ),
        Claim(
            "Large absolute errors of the energy saving occur for large savings",
            "large values",
            f"median saving {large:.0f} J in the worst tenth, {middle:.0f} J in all",
            large > middle,
        ),
    ]


def _forest_on_test(predictions: pa.Table, target: str) -> tuple[np.ndarray, np.ndarray]:
    model, split = (np.array(predictions[name].to_pylist()) for name in ("model", "split"))
    values = columns(predictions, (target, f"{target}_simulated"))[(model == "random_forest") & (split == "test")]
    return values[:, 0], values[:, 1]
