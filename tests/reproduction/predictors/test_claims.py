from __future__ import annotations

import numpy as np
import pyarrow as pa
import pytest

from reproduction.claims import verdict
from reproduction.predictors.claims import predictor_claims
from reproduction.predictors.estimators import MODELS
from robojoule.profile.parameters import TARGETS

PUBLISHED = {"p50": (10.4, 4.5, 4.8), "mean": (18.5, 6.0, 5.0)}


def predictions(relative_error: float, savings: np.ndarray) -> pa.Table:
    count = len(savings)
    measured = np.column_stack([savings, np.linspace(0.5, 2, count), np.linspace(300, 900, count)])
    columns: dict[str, object] = {"model": ["random_forest"] * count, "split": ["test"] * count}
    for place, target in enumerate(TARGETS):
        columns[target] = measured[:, place] * (1 + relative_error)
        columns[f"{target}_simulated"] = measured[:, place]
    return pa.table(columns)


def metrics(scale: float, network: float = 1.0, spearman: float = 0.9) -> dict:
    result: dict = {
        target: {
            model: {
                f"rel_{figure}_percent": values[place] * scale * (network if model == "neural_network" else 1)
                for figure, values in PUBLISHED.items()
            }
            for model in MODELS
        }
        for place, target in enumerate(TARGETS)
    }
    return result | {"suitability": {model: {"spearman_mean": spearman} for model in MODELS}}


def verdicts(table: pa.Table, figures: dict) -> dict[str, str]:
    return {claim.claim: verdict(claim.held) for claim in predictor_claims(table, figures)}


@pytest.mark.parametrize(("scale", "held"), [(0.9, "true"), (1.0, "true"), (1.1, "false")])
def test_errors_are_held_against_the_published_ones(scale: float, held: str) -> None:
    found = verdicts(predictions(0.05, np.linspace(10, 300, 50)), metrics(scale))
    errors = [verdict for claim, verdict in found.items() if "relative error of the" in claim]
    assert errors == [held] * 6


def test_tiny_savings_are_told_apart() -> None:
    savings = np.array([0.001, 100.0, 200.0])
    table = predictions(0.1, savings)
    place = table.column_names.index("energy_saving_j")
    table = table.set_column(place, "energy_saving_j", pa.array([1.0, 110.0, 220.0]))
    claims = predictor_claims(table, metrics(1.0))
    found = next(claim for claim in claims if claim.claim.startswith("Mean relative error of the energy s"))
    assert found.robojoule.endswith("1 J and more: 10.0 %")


@pytest.mark.parametrize(("network", "held"), [(1.0, "true"), (0.85, "true"), (0.6, "false"), (1.5, "false")])
def test_similar_models(network: float, held: str) -> None:
    found = verdicts(predictions(0.05, np.linspace(10, 300, 50)), metrics(1.0, network))
    assert next(verdict for claim, verdict in found.items() if "similarly accurate" in claim) == held


@pytest.mark.parametrize(("error", "held"), [(0.05, "true"), (-0.09, "true"), (0.2, "false")])
def test_durations_within_a_tenth(error: float, held: str) -> None:
    found = verdicts(predictions(error, np.linspace(10, 300, 50)), metrics(1.0))
    assert next(verdict for claim, verdict in found.items() if "within 10 %" in claim) == held


@pytest.mark.parametrize(("spearman", "held"), [(0.9, "true"), (0.7, "false")])
def test_order_of_suitability(spearman: float, held: str) -> None:
    found = verdicts(predictions(0.05, np.linspace(10, 300, 50)), metrics(1.0, spearman=spearman))
    assert next(verdict for claim, verdict in found.items() if "order of suitability" in claim) == held


def test_no_savings_at_all_leave_the_claims_on_sizes_out() -> None:
    found = verdicts(predictions(0.05, np.zeros(5)), metrics(1.0))
    assert not any("occur for" in claim for claim in found)
