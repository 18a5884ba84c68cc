"""The three regimes: same robot and new motions, an unseen payload, an unseen robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from reproduction.config import ForestParams
from reproduction.experiment.gaps import PlanEnergies, gap_rows, win_rows
from reproduction.parts import HERE, Parts
from reproduction.predictors import estimators
from reproduction.profile_predictor.fit import fit_profile_predictor
from reproduction.study.ablations import ablation_methods, ablation_rows, main_methods
from reproduction.study.cases import PlantBatch, generate_trees, observe, speed_limits
from reproduction.study.config import StudyMotionsParams, StudyParams
from reproduction.study.methods import (
    polynomial_method,
    three_segment_method,
)
from reproduction.study.plant import Plant, draw_plant
from reproduction.study.regime_tables import RegimeTables, judged, physics_methods, together
from reproduction.study.three_numbers import motion_features
from reproduction.study.transfer import transferred_prior
from reproduction.tables import Row
from robojoule.arrays import Array
from robojoule.calibration.parameters import Prior
from robojoule.calibration.run_fit import Calibration
from robojoule.calibration.run_model import ObservedRuns, run_parameters
from robojoule.profile.parameters import profile_parameters
from robojoule.profile.predicted import ProfilePredictor
from robojoule.robots import list_robots, load_robot
from robojoule.robots.robot import Payload, Robot

if TYPE_CHECKING:
    from sklearn.pipeline import Pipeline

Progress = Callable[[str], None]
# Streams of one seed that must never meet: plants, training and test trees, hidden states, noise.
STREAMS = ("plant", "training_trees", "test_trees", "training_state", "test_state", "noise", "choice")


def streams(seed: int, *key: int) -> dict[str, np.random.SeedSequence]:
    """Independent seeds by purpose."""
    return dict(zip(STREAMS, np.random.SeedSequence([seed, *key]).spawn(len(STREAMS)), strict=True))


@dataclass(frozen=True)
class Case:
    """A robot with one payload and the plant that it is in truth.

    Attributes:
        robot: Catalog entry with the payload.
        plant: Its plant.
        motions: Trees and runs of the study.
        seeds: Streams of this case, see `streams`.
    """

    robot: Robot
    plant: Plant
    motions: StudyMotionsParams
    seeds: dict[str, np.random.SeedSequence]

    def batch(self, split: Literal["training", "test"], trees: int) -> PlantBatch:
        """Random trees on the plant, each with a hidden state of its own."""
        found = generate_trees(self.robot, self.seeds[f"{split}_trees"], trees, self.motions)
        states = np.random.default_rng(self.seeds[f"{split}_state"]).standard_normal(trees)
        viscosity = np.exp(self.plant.params.temperature_spread * states)
        return PlantBatch(self.robot, found, self.plant, viscosity, float(speed_limits(self.motions)[0]))

    def observed(self, batch: PlantBatch, first_tree: int = 0) -> ObservedRuns:
        """Noisy runs of a batch at all speed limits; see `observe`."""
        rng = np.random.default_rng(self.seeds["noise"])
        return observe(batch, speed_limits(self.motions), rng, first_tree)


def payload_cases(params: StudyParams, regime: int, payloads_kg: Sequence[float]) -> list[Case]:
    """Cases of one robot and plant with several payloads, in the streams of a regime."""
    name, motions = params.evaluate_motions.robot, params.motions
    plant = draw_plant(robot_with_payload(name, 0.0, motions), streams(motions.seed)["plant"], params.plant)
    return [
        Case(robot_with_payload(name, payload, motions), plant, motions, streams(motions.seed, regime, place))
        for place, payload in enumerate(payloads_kg)
    ]


def robot_with_payload(name: str, payload_kg: float, motions: StudyMotionsParams) -> Robot:
    """Catalog entry with a payload of unknown shape."""
    return load_robot(name, Payload(payload_kg, motions.payload_com_m))


@dataclass(frozen=True)
class ThesisForest:
    """The thesis's predictor, a random forest on its features, trained on noisy runs.

    Attributes:
        forest: The fitted estimator.
        slowest: Speed limit of the slowest run. [-]
    """

    forest: Pipeline
    slowest: float

    @classmethod
    def fitted(cls, batch: PlantBatch, targets: Array, params: ForestParams) -> ThesisForest:
        """Train on the three parameters of the motions of a batch, shape (M, 3)."""
        forest = estimators.random_forest(params, seed=1)
        estimators.fit(forest, motion_features(batch.nominal_paths, batch.slowest_speed_limit), targets)
        return cls(forest, batch.slowest_speed_limit)

    def predict(self, batch: PlantBatch) -> Array:
        """Saving [J], optimal duration [s] and penalty [J] of the motions of a batch, shape (M, 3)."""
        return np.asarray(self.forest.predict(motion_features(batch.nominal_paths, self.slowest)))


def same_robot(params: StudyParams, progress: Progress, parts: Parts = HERE) -> RegimeTables:
    """Regime (a): trees never seen of a robot whose plant was observed; several payloads, all of them trained on."""
    settings = params.evaluate_motions
    cases = payload_cases(params, 1, settings.payloads_kg)
    known = parts.map(_same_robot_observed, [(params, case, 10000 * place) for place, case in enumerate(cases)])
    predictor = fit_profile_predictor(cases[-1].robot, [observed for observed, _, _ in known])
    progress(f"same robot: fitted, noise {predictor.calibration.noise:.4f}")
    tasks = [(params, case, predictor, forest, mean) for case, (_, forest, mean) in zip(cases, known, strict=True)]
    tables, whole = together(
        parts.map(
            _same_robot_planned,
            tasks,
            lambda number, _: progress(f"same robot: {cases[number].robot.payload.mass_kg:g} kg planned"),
        )
    )
    key: Row = {"regime": "same_robot", "robot": settings.robot, "payload_kg": "all"}
    tables.ablations = ablation_rows(whole)
    whole = main_methods(whole)
    tables.gaps.extend(gap_rows(whole, key))
    tables.wins.extend(win_rows(whole, key))
    return tables


def _same_robot_observed(params: StudyParams, case: Case, first_tree: int) -> tuple[ObservedRuns, ThesisForest, Array]:
    """Known runs of a payload, the thesis's predictor and the mean of the three parameters of its motions, (3,)."""
    settings = params.evaluate_motions
    batch = case.batch("training", settings.training_trees)
    full = case.observed(batch, first_tree)
    targets = profile_parameters(batch.paths.durations(full.speed_limits), full.energy_j)  # of noisy runs
    forest = ThesisForest.fitted(batch, targets, settings.random_forest)
    return full.thinned(params.motions.runs_per_motion), forest, targets.mean(axis=0)


def _same_robot_planned(
    params: StudyParams, case: Case, predictor: ProfilePredictor, forest: ThesisForest, mean: Array
) -> tuple[RegimeTables, PlanEnergies]:
    motions, predictors = params.motions, {"robojoule_predicted": predictor}
    batch = case.batch("test", params.evaluate_motions.test_trees)
    methods = physics_methods(batch, predictors, motions, cautious=True) | {
        "krc_polynomial_6": polynomial_method(batch, 6, motions.krc_slowest_percent),
        "predicted_three_segment": three_segment_method(forest.predict(batch)),
        **ablation_methods(batch, mean, motions.dense_speed_limits),
    }
    return judged(batch, predictors, methods, motions, "same_robot")


def unseen_payload(params: StudyParams, progress: Progress, parts: Parts = HERE) -> RegimeTables:
    """Regime (b): every payload once left out of training."""
    settings = params.evaluate_motions
    cases = payload_cases(params, 2, settings.unseen_payloads_kg)
    observed = parts.map(_unseen_payload_observed, [(params, case, 10000 * n) for n, case in enumerate(cases)])
    tables, whole = together(
        parts.map(
            _unseen_payload_planned,
            [(params, case, observed[:left_out] + observed[left_out + 1 :]) for left_out, case in enumerate(cases)],
            lambda number, _: progress(
                f"unseen payload: {cases[number].robot.payload.mass_kg:g} kg left out and planned"
            ),
        )
    )
    tables.gaps.extend(gap_rows(whole, {"regime": "unseen_payload", "robot": settings.robot, "payload_kg": "all"}))
    return tables


def _unseen_payload_observed(params: StudyParams, case: Case, first_tree: int) -> ObservedRuns:
    batch = case.batch("training", params.evaluate_motions.unseen_training_trees)
    return case.observed(batch, first_tree).thinned(params.motions.runs_per_motion)


def _unseen_payload_planned(
    params: StudyParams, case: Case, others: Sequence[ObservedRuns]
) -> tuple[RegimeTables, PlanEnergies]:
    predictors = {"robojoule_predicted": fit_profile_predictor(case.robot, others)}
    batch = case.batch("test", params.evaluate_motions.unseen_test_trees)
    return judged(
        batch, predictors, physics_methods(batch, predictors, params.motions), params.motions, "unseen_payload"
    )


def unseen_robot(params: StudyParams, progress: Progress, parts: Parts = HERE) -> RegimeTables:
    """Regime (c): every robot of the catalog once left out, then a few of its motions observed."""
    settings = params.evaluate_robots
    names = settings.robots or list_robots()
    known = parts.map(
        _unseen_robot_observed,
        [(params, name, place) for place, name in enumerate(names)],
        lambda number, _: progress(f"unseen robot: {names[number]} observed"),
    )
    drives = [_rated(name, settings.payload_share, params.motions).drives for name in names]
    fits = [(run_parameters(one, directions), fit) for one, (directions, fit) in zip(drives, known, strict=True)]
    tasks = [
        (params, name, place, transferred_prior(fits[place][0], fits[:place] + fits[place + 1 :]))
        for place, name in enumerate(names)
    ]
    tables, whole = together(
        parts.map(
            _unseen_robot_planned,
            tasks,
            lambda number, _: progress(f"unseen robot: {names[number]} left out and planned"),
        )
    )
    key: Row = {"regime": "unseen_robot", "robot": "all", "payload_kg": "rated share"}
    groups = np.repeat(np.arange(len(names)), settings.test_trees)
    tables.gaps = gap_rows(whole, key, groups) + tables.gaps
    tables.wins = win_rows(whole, key)
    return tables


def _unseen_robot_case(params: StudyParams, name: str, stream: int, place: int) -> Case:
    motions = params.motions
    robot = _rated(name, params.evaluate_robots.payload_share, motions)
    plant = draw_plant(robot, streams(motions.seed)["plant"], params.plant)
    return Case(robot, plant, motions, streams(motions.seed, stream, place))


def _unseen_robot_observed(params: StudyParams, name: str, place: int) -> tuple[Array, Calibration]:
    """What is learned of a robot, for others: its inertial directions and the fit."""
    case = _unseen_robot_case(params, name, 3, place)
    full = case.observed(case.batch("training", params.evaluate_robots.training_trees))
    used = [full.thinned(params.motions.runs_per_motion)]
    predictor = fit_profile_predictor(case.robot, used, residual=False)
    return predictor.directions, predictor.calibration


def _unseen_robot_planned(
    params: StudyParams, name: str, place: int, prior: Prior
) -> tuple[RegimeTables, PlanEnergies]:
    """A robot left out, then a few of its motions known."""
    settings, motions = params.evaluate_robots, params.motions
    case = _unseen_robot_case(params, name, 4, place)
    budget = max(-(-max(settings.measured_motions) // motions.points), 1)
    full = case.observed(case.batch("training", budget)).thinned(motions.runs_per_motion)
    outward = np.arange(len(full.tree)) % (2 * motions.points) < motions.points  # the way back is the same line
    chosen = np.flatnonzero(outward)
    predictors = {}
    for count in settings.measured_motions:
        rows = np.zeros(len(full.tree), dtype=bool)
        rows[chosen[:count]] = True
        used = [full.only(rows)] if count else []
        predictors[f"robojoule_predicted_{count}"] = fit_profile_predictor(case.robot, used, prior, residual=False)
    batch = case.batch("test", settings.test_trees)
    polynomial = polynomial_method(batch, 6, motions.krc_slowest_percent)
    methods = physics_methods(batch, predictors, motions) | {"krc_polynomial_6": polynomial}
    return judged(batch, predictors, methods, motions, "unseen_robot")


def _rated(name: str, share: float, motions: StudyMotionsParams) -> Robot:
    bare = load_robot(name)
    return robot_with_payload(name, round(share * bare.file.rated_payload_kg, 3), motions)
