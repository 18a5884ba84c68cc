from __future__ import annotations

import numpy as np
import pytest

from reproduction.config import ForestParams, NeuralNetworkParams, TrainPredictorsParams
from reproduction.predictors.estimators import MODELS, fit, make_estimator
from robojoule.errors import InputError

PARAMS = TrainPredictorsParams(
    seed=1,
    random_forest=ForestParams(n_estimators=20, min_samples_leaf=1, max_features=1),
    neural_network=NeuralNetworkParams(networks=2, hidden_layers=[16], alpha=0.0, learning_rate=0.01, max_epochs=150),
)


def rows(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    inputs = np.random.default_rng(seed).uniform(-1, 1, (count, 4)) * [1, 1000, 1, 1]
    return inputs, np.column_stack([inputs[:, 0] * 100, inputs[:, 1] / 1000 * 0.01 + 1, inputs[:, 2] ** 2 * 1000])


@pytest.mark.parametrize("model", MODELS)
def test_learns_a_known_relation_on_any_scale(model: str) -> None:
    estimator = fit(make_estimator(model, PARAMS), *rows(600, 0))
    inputs, truth = rows(200, 1)
    residual = np.abs(estimator.predict(inputs) - truth).mean(axis=0) / truth.std(axis=0)
    assert (residual < 0.2).all()


@pytest.mark.parametrize("model", MODELS)
def test_same_seed_same_bits_other_seed_others(model: str) -> None:
    inputs, _ = rows(50, 1)
    first, again, other = (
        fit(make_estimator(model, PARAMS.model_copy(update={"seed": seed})), *rows(80, 0)).predict(inputs)
        for seed in (1, 1, 2)
    )
    assert (first == again).all()
    assert (first != other).any()


@pytest.mark.parametrize("model", MODELS)
def test_inputs_are_scaled_first(model: str) -> None:
    estimator = make_estimator(model, PARAMS)
    assert type(estimator.steps[0][1]).__name__ == "StandardScaler"
    scaled = fit(estimator, *rows(80, 0)).named_steps["scale"].transform(rows(80, 0)[0])
    assert scaled.mean(axis=0) == pytest.approx(0, abs=1e-12)
    assert scaled.std(axis=0) == pytest.approx(1)


def test_predicts_with_one_job() -> None:
    estimator = fit(make_estimator("random_forest", PARAMS), *rows(80, 0))
    assert {forest.n_jobs for forest in estimator.named_steps["regress"].estimators_} == {1}


def test_unknown_model_is_refused() -> None:
    with pytest.raises(InputError, match="allowed: random_forest, neural_network"):
        make_estimator("oracle", PARAMS)
