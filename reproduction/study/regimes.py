"""The three regimes: same robot and new motions, an unseen payload, an unseen robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from reproduction.config import ForestParams
from reproduction.experiment.gaps import PlanEnergies, gap_rows, win_rows
from reproduction.methods.method import Method, Variant
from reproduction.methods.on_source import OnSource
from reproduction.predictors import estimators
from reproduction.profile_predictor.fit import fit_profile_predictor
from reproduction.study.ablations import ablation_methods, ablation_rows, main_methods
from reproduction.study.cases import PlantBatch, draw_viscosity, generate_trees, observe
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


def plant_batch(
    robot: Robot,
    plant: Plant,
    trees: int,
    motions: StudyMotionsParams,
    tree_seed: np.random.SeedSequence,
    state_seed: np.random.SeedSequence,
) -> PlantBatch:
    """Random trees on a plant, each with a hidden state of its own."""
    found = generate_trees(robot, tree_seed, trees, motions)
    return PlantBatch(robot, found, plant, draw_viscosity(plant, np.random.default_rng(state_seed), trees))


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


def same_robot(params: StudyParams, progress: Progress) -> RegimeTables:
    """Regime (a): trees never seen of a robot whose plant was observed; several payloads, all of them trained on."""
    settings, motions = params.evaluate_motions, params.motions
    limits = speed_limits(motions)
    tables, observed, learned, means = RegimeTables(), [], [], []
    plants_seed = streams(motions.seed)["plant"]
    plant = draw_plant(robot_with_payload(settings.robot, 0.0, motions), plants_seed, params.plant)
    for place, payload in enumerate(settings.payloads_kg):
        seeds = streams(motions.seed, 1, place)
        robot = robot_with_payload(settings.robot, payload, motions)
        batch = plant_batch(
            robot, plant, settings.training_trees, motions, seeds["training_trees"], seeds["training_state"]
        )
        full = observe(batch, limits, np.random.default_rng(seeds["noise"]), first_tree=10000 * place)
        observed.append(full.thinned(motions.runs_per_motion))
        learned.append(_thesis_forest(batch, full, settings.random_forest))
        means.append(_observed_parameters(batch, full).mean(axis=0))
    predictor = fit_profile_predictor(robot, observed)
    progress(f"same robot: fitted, noise {predictor.calibration.noise:.4f}")
    plans = []
    for place, payload in enumerate(settings.payloads_kg):
        seeds = streams(motions.seed, 1, place)
        robot = robot_with_payload(settings.robot, payload, motions)
        batch = plant_batch(robot, plant, settings.test_trees, motions, seeds["test_trees"], seeds["test_state"])
        key: Row = {"regime": "same_robot", "robot": robot.name, "payload_kg": payload}
        prediction_rows(tables, batch, {"robojoule_predicted": predictor}, motions, key)
        methods = physics_methods(batch, {"robojoule_predicted": predictor}, motions, cautious=True)
        methods |= {
            "krc_polynomial_6": polynomial_method(batch, 6),
            "predicted_three_segment": three_segment_method(learned[place](batch)),
        }
        methods |= ablation_methods(batch, means[place], motions.dense_speed_limits)
        plans.append(evaluate_plans(batch, methods, motions.relaxations_percent, motions.dense_speed_limits))
        plan_rows(tables, main_methods(plans[-1]), key)
        progress(f"same robot: {payload:g} kg planned")
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
    settings, motions = params.evaluate_motions, params.motions
    limits, tables = speed_limits(motions), RegimeTables()
    plant = draw_plant(robot_with_payload(settings.robot, 0.0, motions), streams(motions.seed)["plant"], params.plant)
    payloads = settings.unseen_payloads_kg
    robots = [robot_with_payload(settings.robot, payload, motions) for payload in payloads]
    observed = []
    for place, robot in enumerate(robots):
        seeds = streams(motions.seed, 2, place)
        batch = plant_batch(
            robot, plant, settings.unseen_training_trees, motions, seeds["training_trees"], seeds["training_state"]
        )
        rng = np.random.default_rng(seeds["noise"])
        observed.append(observe(batch, limits, rng, first_tree=10000 * place, runs_per_motion=motions.runs_per_motion))
    plans = []
    for place, (robot, payload) in enumerate(zip(robots, payloads, strict=True)):
        seeds = streams(motions.seed, 2, place)
        predictor = fit_profile_predictor(robot, [m for other, m in enumerate(observed) if other != place])
        batch = plant_batch(robot, plant, settings.unseen_test_trees, motions, seeds["test_trees"], seeds["test_state"])
        key: Row = {"regime": "unseen_payload", "robot": robot.name, "payload_kg": payload}
        prediction_rows(tables, batch, {"robojoule_predicted": predictor}, motions, key)
        methods = physics_methods(batch, {"robojoule_predicted": predictor}, motions)
        plans.append(evaluate_plans(batch, methods, motions.relaxations_percent, motions.dense_speed_limits))
        plan_rows(tables, plans[-1], key)
        progress(f"unseen payload: {payload:g} kg left out and planned")
    together: Row = {"regime": "unseen_payload", "robot": settings.robot, "payload_kg": "all"}
    tables.gaps.extend(gap_rows(joined(plans), together))
    return tables


def unseen_robot(params: StudyParams, progress: Progress, names: Sequence[str] | None = None) -> RegimeTables:
    """Regime (c): every robot of the catalog once left out, then a few of its motions observed."""
    settings, motions = params.evaluate_robots, params.motions
    limits, tables = speed_limits(motions), RegimeTables()
    names = list(names or list_robots())
    known: dict[str, tuple[ParameterVector, Calibration]] = {}
    robots: dict[str, Robot] = {}
    plants: dict[str, Plant] = {}
    plant_seed = streams(motions.seed)["plant"]
    for place, name in enumerate(names):
        robots[name] = robot = _rated(name, settings.payload_share, motions)
        plants[name] = plant = draw_plant(robot, plant_seed, params.plant)
        seeds = streams(motions.seed, 3, place)
        batch = plant_batch(
            robot, plant, settings.training_trees, motions, seeds["training_trees"], seeds["training_state"]
        )
        rng = np.random.default_rng(seeds["noise"])
        predictor = fit_profile_predictor(
            robot, [observe(batch, limits, rng, runs_per_motion=motions.runs_per_motion)], residual=False
        )
        known[name] = (run_parameters(robot.drives, predictor.directions), predictor.calibration)
        progress(f"unseen robot: {name} observed")
    plans, groups, errors = [], [], RegimeTables()
    for place, name in enumerate(names):
        robot, seeds = robots[name], streams(motions.seed, 4, place)
        prior = transferred_prior(known[name][0], [known[other] for other in names if other != name])
        largest = max(settings.measured_motions)
        budget = plant_batch(
            robot,
            plants[name],
            max(-(-largest // motions.points), 1),
            motions,
            seeds["training_trees"],
            seeds["training_state"],
        )
        full = observe(budget, limits, np.random.default_rng(seeds["noise"]), runs_per_motion=motions.runs_per_motion)
        outward = np.arange(len(full.tree)) % (2 * motions.points) < motions.points  # the way back is the same line
        chosen = np.flatnonzero(outward)
        predictors = {}
        for count in settings.measured_motions:
            rows = np.zeros(len(full.tree), dtype=bool)
            rows[chosen[:count]] = True
            used = [full.only(rows)] if count else []
            predictors[f"robojoule_predicted_{count}"] = fit_profile_predictor(robot, used, prior, residual=False)
        batch = plant_batch(robot, plants[name], settings.test_trees, motions, seeds["test_trees"], seeds["test_state"])
        key: Row = {"regime": "unseen_robot", "robot": name, "payload_kg": robot.payload.mass_kg}
        prediction_rows(errors, batch, predictors, motions, key)
        methods = physics_methods(batch, predictors, motions) | {"krc_polynomial_6": polynomial_method(batch, 6)}
        plans.append(evaluate_plans(batch, methods, motions.relaxations_percent, motions.dense_speed_limits))
        groups += [place] * settings.test_trees
        plan_rows(tables, plans[-1], key)
        progress(f"unseen robot: {name} left out and planned")
    tables.errors, tables.coverage = errors.errors, errors.coverage
    together: Row = {"regime": "unseen_robot", "robot": "all", "payload_kg": "rated share"}
    whole = joined(plans)
    tables.gaps = gap_rows(whole, together, groups) + tables.gaps
    tables.wins = win_rows(whole, together)
    return tables


def _rated(name: str, share: float, motions: StudyMotionsParams) -> Robot:
    bare = load_robot(name)
    return robot_with_payload(name, round(share * bare.file.rated_payload_kg, 3), motions)
