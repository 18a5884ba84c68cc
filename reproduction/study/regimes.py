"""The three regimes: same robot and new motions, an unseen payload, an unseen robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from reproduction.config import ForestParams
from reproduction.experiment.gaps import PlanEnergies, gap_rows, win_rows
from reproduction.methods.method import Method, Variant
from reproduction.methods.on_source import OnSource
from reproduction.predictors import estimators
from reproduction.profile_predictor.fit import fit_profile_predictor
from reproduction.study.ablations import ablation_methods, ablation_rows, main_methods
from reproduction.study.cases import PlantBatch, generate_trees, observe
from reproduction.study.config import StudyMotionsParams, StudyParams
from reproduction.study.methods import (
    evaluate_plans,
    hull_profiles,
    polynomial_method,
    three_segment_method,
)
from reproduction.study.plant import Plant, draw_plant
from reproduction.study.summary import parameter_rows
from reproduction.study.three_numbers import motion_features
from reproduction.study.transfer import transferred_prior
from reproduction.tables import Row
from robojoule.arrays import Array
from robojoule.calibration.parameters import ParameterVector
from robojoule.calibration.run_fit import Calibration
from robojoule.calibration.run_model import ObservedRuns, run_parameters
from robojoule.profile.parameters import profile_parameters
from robojoule.profile.predicted import PredictedProfiles, ProfilePredictor
from robojoule.profile.source import ProfileSource
from robojoule.robots import list_robots, load_robot
from robojoule.robots.robot import Payload, Robot

Progress = Callable[[str], None]
# Streams of one seed that must never meet: plants, training and test trees, hidden states, noise.
STREAMS = ("plant", "training_trees", "test_trees", "training_state", "test_state", "noise", "choice")


@dataclass
class RegimeTables:
    """Result tables of a regime.

    Attributes:
        errors: Errors of the three parameters.
        gaps: Gaps to the optimum.
        wins: Wins and losses of methods against each other.
        plans: Energies of all plans.
        coverage: How often intervals hold the truth.
        ablations: Gaps with one step exchanged at a time.
    """

    errors: list[Row] = field(default_factory=list)
    gaps: list[Row] = field(default_factory=list)
    wins: list[Row] = field(default_factory=list)
    plans: list[Row] = field(default_factory=list)
    coverage: list[Row] = field(default_factory=list)
    ablations: list[Row] = field(default_factory=list)


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


def speed_limits(params: StudyMotionsParams) -> Array:
    """Speed limits of observed runs, fractions, shape (S,)."""
    return np.array(params.speed_limits_percent) / 100.0


def robot_with_payload(name: str, payload_kg: float, motions: StudyMotionsParams) -> Robot:
    """Catalog entry with a payload of unknown shape."""
    return load_robot(name, Payload(payload_kg, motions.payload_com_m))


def prediction_rows(
    tables: RegimeTables,
    batch: PlantBatch,
    predictors: dict[str, ProfilePredictor],
    motions: StudyMotionsParams,
    key: Row,
) -> None:
    """Errors of predictors, nominal physics and the oracle, at the observed speed limits and on a fine grid."""
    grids = {"measured": speed_limits(motions), "fine": batch.speed_limits(motions.fine_speed_limits)}
    for grid, at in grids.items():
        runs = batch.paths.simulate(at)
        truth = profile_parameters(runs.duration_s, runs.energy_j)
        energies = {
            "oracle": batch.oracle_paths.simulate(at).energy_j,
            "nominal_physics": batch.nominal_paths.simulate(at).energy_j,
        }
        for name, predictor in predictors.items():
            predicted = predictor.predict(batch.nominal_paths, at)
            energies[name] = predicted.energy_j
            moving = batch.paths.moving
            inside = (runs.energy_j >= predicted.lower_j) & (runs.energy_j <= predicted.upper_j)
            if grid == "measured":
                width = (predicted.upper_j - predicted.lower_j)[moving] / 2.0 / predicted.energy_j[moving]
                tables.coverage.append(
                    key
                    | {
                        "model": name,
                        "coverage_percent": round(100.0 * float(inside[moving].mean()), 2),
                        "half_width_percent": round(100.0 * float(np.median(width)), 3),
                        "idle_error_percent": round(100.0 * _idle_error(batch, predicted), 4),
                        "noise_percent": round(100.0 * predictor.calibration.noise, 3),
                        "state_spread": round(predictor.calibration.state_spread, 4),
                        "residual_gain": round(predictor.residual.gain, 4),
                    }
                )
        for name, energy in energies.items():
            found = profile_parameters(runs.duration_s, energy)
            tables.errors.extend(parameter_rows(found, truth, key | {"model": name, "grid": grid}))


def _idle_error(batch: PlantBatch, predicted: PredictedProfiles) -> float:
    """Median relative error of idle power at both ends of the motions. [-]"""
    truth = np.concatenate([batch.idle_prior_w, batch.idle_post_w])
    found = np.concatenate([predicted.idle_start_w, predicted.idle_end_w])
    return float(np.median(np.abs(found / truth - 1.0)))


def plan_rows(tables: RegimeTables, plans: PlanEnergies, key: Row) -> None:
    """Add gaps, wins and energies."""
    tables.gaps.extend(gap_rows(plans, key))
    tables.wins.extend(win_rows(plans, key))
    for method, energies in plans.energy_j.items():
        for tree, row in enumerate(energies.tolist()):
            for percent, energy in zip(plans.cycle_times_percent, row, strict=True):
                tables.plans.append(
                    key | {"tree": tree, "relaxation_percent": percent, "method": method, "energy_j": energy}
                )


def joined(parts: Sequence[PlanEnergies]) -> PlanEnergies:
    """Plans of several batches as one."""
    names = parts[0].energy_j
    return PlanEnergies(
        parts[0].cycle_times_percent, {name: np.concatenate([part.energy_j[name] for part in parts]) for name in names}
    )


def physics_methods(
    batch: PlantBatch, predictors: dict[str, ProfilePredictor], params: StudyMotionsParams, *, cautious: bool = False
) -> dict[str, Method]:
    """Planning on the profiles of predictors, of nominal physics and of the oracle, by name."""
    limits = batch.speed_limits(params.predicted_speed_limits)
    sources: dict[str, ProfileSource] = {
        "nominal_physics": hull_profiles(batch.nominal_paths, limits),
        "oracle": hull_profiles(batch.oracle_paths, limits),
    }
    for name, predictor in predictors.items():
        predicted = predictor.predict(batch.nominal_paths, limits)
        sources[name] = predicted
        if cautious:
            sources[f"{name}_cautious"] = predicted.cautious()
    return {name: OnSource(Variant(name), source) for name, source in sources.items()}


def judged(
    tables: RegimeTables,
    batch: PlantBatch,
    predictors: dict[str, ProfilePredictor],
    methods: dict[str, Method],
    motions: StudyMotionsParams,
    regime: str,
) -> PlanEnergies:
    """Add what predictions and plans of a batch are worth; energies of all plans."""
    key: Row = {"regime": regime, "robot": batch.robot.name, "payload_kg": batch.robot.payload.mass_kg}
    prediction_rows(tables, batch, predictors, motions, key)
    plans = evaluate_plans(batch, methods, motions.relaxations_percent, motions.dense_speed_limits)
    plan_rows(tables, main_methods(plans), key)
    return plans


def same_robot(params: StudyParams, progress: Progress) -> RegimeTables:
    """Regime (a): trees never seen of a robot whose plant was observed; several payloads, all of them trained on."""
    settings, motions = params.evaluate_motions, params.motions
    cases = payload_cases(params, 1, settings.payloads_kg)
    tables, observed, learned, means = RegimeTables(), [], [], []
    for place, case in enumerate(cases):
        batch = case.batch("training", settings.training_trees)
        full = case.observed(batch, first_tree=10000 * place)
        observed.append(full.thinned(motions.runs_per_motion))
        learned.append(_thesis_forest(batch, full, settings.random_forest))
        means.append(_observed_parameters(batch, full).mean(axis=0))
    predictors = {"robojoule_predicted": fit_profile_predictor(cases[-1].robot, observed)}
    progress(f"same robot: fitted, noise {predictors['robojoule_predicted'].calibration.noise:.4f}")
    plans = []
    for case, forest, mean in zip(cases, learned, means, strict=True):
        batch = case.batch("test", settings.test_trees)
        methods = physics_methods(batch, predictors, motions, cautious=True) | {
            "krc_polynomial_6": polynomial_method(batch, 6, motions.krc_slowest_percent),
            "predicted_three_segment": three_segment_method(forest(batch)),
            **ablation_methods(batch, mean, motions.dense_speed_limits),
        }
        plans.append(judged(tables, batch, predictors, methods, motions, "same_robot"))
        progress(f"same robot: {case.robot.payload.mass_kg:g} kg planned")
    together: Row = {"regime": "same_robot", "robot": settings.robot, "payload_kg": "all"}
    whole = joined(plans)
    tables.ablations = ablation_rows(whole)
    whole = main_methods(whole)
    tables.gaps.extend(gap_rows(whole, together))
    tables.wins.extend(win_rows(whole, together))
    return tables


def _thesis_forest(batch: PlantBatch, observed: ObservedRuns, params: ForestParams) -> Callable[[PlantBatch], Array]:
    """The thesis's predictor, a random forest on its features, trained on noisy runs."""
    slowest = batch.slowest_speed_limit
    forest = estimators.random_forest(params, seed=1)
    estimators.fit(forest, motion_features(batch.nominal_paths, slowest), _observed_parameters(batch, observed))
    return lambda other: np.asarray(forest.predict(motion_features(other.nominal_paths, slowest)))


def _observed_parameters(batch: PlantBatch, observed: ObservedRuns) -> Array:
    """Saving [J], optimal duration [s] and penalty [J] of noisy runs, shape (M, 3)."""
    return profile_parameters(batch.paths.durations(observed.speed_limits), observed.energy_j)


def unseen_payload(params: StudyParams, progress: Progress) -> RegimeTables:
    """Regime (b): every payload once left out of training."""
    settings, motions, tables = params.evaluate_motions, params.motions, RegimeTables()
    cases = payload_cases(params, 2, settings.unseen_payloads_kg)
    observed = [
        case.observed(case.batch("training", settings.unseen_training_trees), first_tree=10000 * place)
        for place, case in enumerate(cases)
    ]
    plans = []
    for left_out, case in enumerate(cases):
        used = [runs.thinned(motions.runs_per_motion) for place, runs in enumerate(observed) if place != left_out]
        predictors = {"robojoule_predicted": fit_profile_predictor(case.robot, used)}
        batch = case.batch("test", settings.unseen_test_trees)
        methods = physics_methods(batch, predictors, motions)
        plans.append(judged(tables, batch, predictors, methods, motions, "unseen_payload"))
        progress(f"unseen payload: {case.robot.payload.mass_kg:g} kg left out and planned")
    together: Row = {"regime": "unseen_payload", "robot": settings.robot, "payload_kg": "all"}
    tables.gaps.extend(gap_rows(joined(plans), together))
    return tables


def unseen_robot(params: StudyParams, progress: Progress, names: Sequence[str] | None = None) -> RegimeTables:
    """Regime (c): every robot of the catalog once left out, then a few of its motions observed."""
    settings, motions, tables = params.evaluate_robots, params.motions, RegimeTables()
    known: dict[str, tuple[ParameterVector, Calibration]] = {}
    cases = []
    for place, name in enumerate(names or list_robots()):
        robot = _rated(name, settings.payload_share, motions)
        plant = draw_plant(robot, streams(motions.seed)["plant"], params.plant)
        case = Case(robot, plant, motions, streams(motions.seed, 3, place))
        full = case.observed(case.batch("training", settings.training_trees))
        predictor = fit_profile_predictor(robot, [full.thinned(motions.runs_per_motion)], residual=False)
        known[name] = (run_parameters(robot.drives, predictor.directions), predictor.calibration)
        cases.append(replace(case, seeds=streams(motions.seed, 4, place)))
        progress(f"unseen robot: {name} observed")
    plans = []
    for (name, (vector, _)), case in zip(known.items(), cases, strict=True):
        prior = transferred_prior(vector, [known[other] for other in known if other != name])
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
        plans.append(judged(tables, batch, predictors, methods, motions, "unseen_robot"))
        progress(f"unseen robot: {name} left out and planned")
    together: Row = {"regime": "unseen_robot", "robot": "all", "payload_kg": "rated share"}
    whole, groups = joined(plans), np.repeat(np.arange(len(cases)), settings.test_trees)
    tables.gaps = gap_rows(whole, together, groups) + tables.gaps
    tables.wins = win_rows(whole, together)
    return tables


def _rated(name: str, share: float, motions: StudyMotionsParams) -> Robot:
    bare = load_robot(name)
    return robot_with_payload(name, round(share * bare.file.rated_payload_kg, 3), motions)
