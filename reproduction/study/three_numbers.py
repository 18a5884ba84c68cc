"""Predictors of three numbers per motion, beside the physics-informed one: the thesis's features, usual models.

Hyperparameters are chosen by cross-validation by tree inside the training trees (the inner loop of a nested
cross-validation).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array
from robojoule.motion.simulation import MotionPaths

MODELS = (
    "mean",
    "ridge",
    "random_forest",
    "extra_trees",
    "gradient_boosting",
    "shallow_network",
    "mlp",
)
_TREES = 60


def motion_features(paths: MotionPaths, slowest_speed_limit: float) -> Array:
    """The thesis's features (5.2) of M motions, from the trajectory generator: shape (M, 3 + 6 n).

    Order as in `reproduction.predictors.profile_parameters.input_names`: vertical and horizontal distance [m], rotation
    [rad], then for each joint its angle [rad] and by how much speed, acceleration, deceleration and the jerks of both
    [rad/s .. rad/s3] of the fastest run exceed those of the slowest one.

    Args:
        paths: Motions of the nominal entry.
        slowest_speed_limit: Speed limit of the slowest run, a fraction in (0, 1]. [-]
    """
    start, orientation_start = paths.robot.tool_placements(paths.start_rad)
    end, orientation_end = paths.robot.tool_placements(paths.start_rad + paths.delta_rad)
    way = end - start
    chord = np.minimum(
        np.linalg.norm(orientation_end - orientation_start, axis=1),
        np.linalg.norm(orientation_end + orientation_start, axis=1),
    )
    rotation = 4.0 * np.arcsin(np.minimum(1.0, chord / 2.0))
    velocity = paths.peak_velocities([slowest_speed_limit, 1.0])
    acceleration = np.zeros_like(velocity)
    rows = np.flatnonzero(paths.moving)
    filter_s = paths.timing.robot.drives.filter_time_s
    jerk = np.zeros_like(velocity)
    if rows.size:
        allowed = paths.timing.acceleration[rows, None]
        jerk[rows] = allowed / filter_s
        short = velocity[rows] < allowed * filter_s
        acceleration[rows] = np.where(short, np.sqrt(velocity[rows] * jerk[rows]), allowed)
    faster = [np.ptp(figure, axis=1) for figure in (velocity, acceleration, acceleration, jerk, jerk)]
    travel = np.abs(paths.delta_rad)
    joints = [travel, *(travel * figure[:, np.newaxis] for figure in faster)]
    place = np.stack([np.abs(way[:, 2]), np.linalg.norm(way[:, :2], axis=1), rotation], axis=1)
    return np.concatenate([place, np.stack(joints, axis=2).reshape(len(travel), -1)], axis=1)


@dataclass(frozen=True)
class Fitted:
    """A fitted model.

    Attributes:
        estimator: scikit-learn estimator.
        chosen: Hyperparameters that the inner cross-validation chose.
    """

    estimator: Any
    chosen: dict[str, object]

    def predict(self, features: Array) -> Array:
        """Predicted parameters, shape (M, 3)."""
        return np.asarray(self.estimator.predict(features))


def fit_model(
    name: str,
    features: Array,
    targets: Array,
    tree: NDArray[np.intp],
    *,
    inner_folds: int,
    seed: int,
    shallow_samples: int,
) -> Fitted:
    """Choose hyperparameters by tree and fit.

    Args:
        name: One of `MODELS`.
        features: Shape (M, k).
        targets: Shape (M, 3).
        tree: Tree of each motion, shape (M,).
        inner_folds: Folds of the inner cross-validation.
        seed: Seed of the model.
        shallow_samples: Motions on which the shallow network is trained.
    """
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.model_selection import GridSearchCV, GroupKFold
    from threadpoolctl import threadpool_limits

    estimator, grid = _estimator(name, seed)
    if name == "shallow_network" and len(features) > shallow_samples:
        chosen = np.sort(np.random.default_rng(seed).permutation(len(features))[:shallow_samples])
        features, targets, tree = features[chosen], targets[chosen], tree[chosen]
    with warnings.catch_warnings(), threadpool_limits(1):
        warnings.simplefilter("ignore", ConvergenceWarning)
        if not grid:
            return Fitted(estimator.fit(features, targets), {})
        search = GridSearchCV(estimator, grid, scoring="neg_mean_absolute_error", cv=GroupKFold(inner_folds))
        search.fit(features, targets, groups=tree)
        return Fitted(search.best_estimator_, {key.split("__")[-1]: v for key, v in search.best_params_.items()})


def _estimator(name: str, seed: int) -> tuple[Any, dict[str, list[Any]]]:
    from sklearn.compose import TransformedTargetRegressor
    from sklearn.dummy import DummyRegressor
    from sklearn.ensemble import ExtraTreesRegressor, HistGradientBoostingRegressor, RandomForestRegressor
    from sklearn.linear_model import Ridge
    from sklearn.multioutput import MultiOutputRegressor
    from sklearn.neural_network import MLPRegressor
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    def scaled(regressor: Any) -> Any:
        return TransformedTargetRegressor(make_pipeline(StandardScaler(), regressor), transformer=StandardScaler())

    forest: dict[str, list[Any]] = {
        "regressor__{}__min_samples_leaf": [1, 3],
        "regressor__{}__max_features": [0.4, 1.0],
    }
    alphas = [0.01, 0.1, 1.0]
    cases: dict[str, tuple[Any, dict[str, list[Any]]]] = {
        "mean": (DummyRegressor(), {}),
        "ridge": (scaled(Ridge()), {"regressor__ridge__alpha": [0.1, 1.0, 10.0, 100.0]}),
        "random_forest": (
            scaled(RandomForestRegressor(_TREES, random_state=seed)),
            {key.format("randomforestregressor"): values for key, values in forest.items()},
        ),
        "extra_trees": (
            scaled(ExtraTreesRegressor(_TREES, random_state=seed)),
            {key.format("extratreesregressor"): values for key, values in forest.items()},
        ),
        "gradient_boosting": (
            scaled(MultiOutputRegressor(HistGradientBoostingRegressor(max_iter=120, random_state=seed))),
            {
                "regressor__multioutputregressor__estimator__learning_rate": [0.05, 0.15],
                "regressor__multioutputregressor__estimator__max_leaf_nodes": [6, 20],
            },
        ),
        "shallow_network": (
            scaled(
                MLPRegressor(
                    hidden_layer_sizes=(10,), activation="tanh", solver="lbfgs", max_iter=400, random_state=seed
                )
            ),
            {"regressor__mlpregressor__alpha": alphas},
        ),
        "mlp": (
            scaled(
                MLPRegressor(hidden_layer_sizes=(64, 32), learning_rate_init=0.003, max_iter=200, random_state=seed)
            ),
            {"regressor__mlpregressor__alpha": alphas},
        ),
    }
    return cases[name]
