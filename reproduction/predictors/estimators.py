"""Factories of unfitted scikit-learn estimators: 3 + 6 n inputs to the three parameters of an energy profile."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from reproduction.config import ForestParams, NeuralNetworkParams, TrainPredictorsParams
from robojoule.errors import InputError

if TYPE_CHECKING:
    from sklearn.pipeline import Pipeline

MODELS = ("random_forest", "neural_network")
"""Names of the models, the preferred one of the thesis first."""


def make_estimator(model: str, params: TrainPredictorsParams) -> Pipeline:
    """Unfitted estimator named `model`, one of `MODELS`.

    Raises:
        InputError: There is no such model.
    """
    if model == "random_forest":
        return random_forest(params.random_forest, params.seed)
    if model == "neural_network":
        return neural_network(params.neural_network, params.seed)
    raise InputError(f"unknown model '{model}'", allowed=", ".join(MODELS))


def random_forest(params: ForestParams, seed: int) -> Pipeline:
    """Standard scaler and one random forest a target (thesis 5.2).

    Fits with two jobs (the fit does not depend on their number). Predict only after `set_jobs(estimator, 1)`: with more
    jobs the trees are summed in the order in which they finish.
    """
    from sklearn.ensemble import RandomForestRegressor
    from sklearn.multioutput import MultiOutputRegressor
    from sklearn.pipeline import Pipeline
    from sklearn.preprocessing import StandardScaler

    forest = RandomForestRegressor(
        n_estimators=params.n_estimators,
        min_samples_leaf=params.min_samples_leaf,
        max_features=float(params.max_features),
        random_state=seed,
        n_jobs=2,
    )
    return Pipeline([("scale", StandardScaler()), ("regress", MultiOutputRegressor(forest))])


def neural_network(params: NeuralNetworkParams, seed: int) -> Pipeline:
    """Standard scaler and the mean of several multi-layer perceptrons, each predicting all targets.

    Targets are scaled to mean 0 and deviation 1 for the fit. The networks differ in their initial weights only; their
    mean is closer to the truth than any of them.
    """
    from sklearn.compose import TransformedTargetRegressor
    from sklearn.ensemble import BaggingRegressor
    from sklearn.neural_network import MLPRegressor
    from sklearn.pipeline import Pipeline
    from sklearn.preprocessing import StandardScaler

    network = MLPRegressor(
        hidden_layer_sizes=tuple(params.hidden_layers),
        alpha=params.alpha,
        learning_rate_init=params.learning_rate,
        max_iter=params.max_epochs,
        n_iter_no_change=params.max_epochs,
    )
    networks = BaggingRegressor(network, n_estimators=params.networks, bootstrap=False, random_state=seed)
    scaled = TransformedTargetRegressor(regressor=networks, transformer=StandardScaler())
    return Pipeline([("scale", StandardScaler()), ("regress", scaled)])


def fit(estimator: Pipeline, inputs: Any, targets: Any) -> Pipeline:
    """Fit `estimator` so that the same data give the same bits, and make it ready to predict.

    Args:
        estimator: From one of the factories.
        inputs: Shape (N, 3 + 6 n), array or data frame.
        targets: Columns in the order of `TARGETS`, shape (N, 3).

    Returns:
        The same estimator, fitted, with one job.
    """
    import warnings

    from sklearn.exceptions import ConvergenceWarning
    from threadpoolctl import threadpool_limits

    with warnings.catch_warnings(), threadpool_limits(1):  # sums of a matrix product depend on the number of threads
        warnings.simplefilter("ignore", ConvergenceWarning)  # the number of epochs is a chosen parameter
        estimator.fit(inputs, targets)
    return set_jobs(estimator, 1)


def set_jobs(estimator: Pipeline, jobs: int) -> Pipeline:
    """Set the number of jobs of every forest inside `estimator`, and return it."""
    regressor = estimator.named_steps["regress"]
    for member in getattr(regressor, "estimators_", [getattr(regressor, "estimator", None)]):
        if hasattr(member, "n_jobs"):
            member.n_jobs = jobs
    return estimator
