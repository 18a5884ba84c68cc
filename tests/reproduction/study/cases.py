"""A small plant and its measured trees."""

from functools import cache

import numpy as np

from reproduction.config import ForestParams
from reproduction.study.cases import PlantBatch, generate_trees, observe
from reproduction.study.config import (
    ComparePredictorsParams,
    EvaluateMotionsParams,
    EvaluateRobotsParams,
    StudyMotionsParams,
    StudyParams,
    load_study_params,
)
from reproduction.study.plant import Plant, PlantParams, draw_plant
from robojoule.calibration.run_model import ObservedRuns
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload, Robot

MOTIONS = StudyMotionsParams(
    seed=5,
    payload_com_m=(0.0, 0.0, 0.1),
    points=3,
    budget_rad=(1.8, 3.5),
    speed_limits_percent=[10, 20, 35, 50, 70, 100],
    runs_per_motion=3,
    krc_slowest_percent=15.0,
    predicted_speed_limits=25,
    fine_speed_limits=46,
    dense_speed_limits=41,
    relaxations_percent=[110, 150],
)
LIMITS = np.array(MOTIONS.speed_limits_percent) / 100.0


@cache
def nominal(payload_kg: float = 10.0) -> Robot:
    return load_robot("kuka_kr16_r2010_2", Payload(payload_kg))


# As far from the entry as the predictor expects: the studies' plants are further.
EXPECTED = {
    "inertia_spread": 0.15,
    "drive_spread": 0.25,
    "base_spread": 0.1,
    "temperature_spread": 0.15,
    "noise": 0.02,
}


def plant(**changes: object) -> Plant:
    return draw_plant(nominal(), 3, PlantParams(**(EXPECTED | changes)))


def batch(of: Plant, trees: int, seed: int, payload_kg: float = 10.0) -> PlantBatch:
    robot = nominal(payload_kg)
    states, places = np.random.SeedSequence(seed).spawn(2)
    factors = np.exp(of.params.temperature_spread * np.random.default_rng(states).standard_normal(trees))
    return PlantBatch(robot, generate_trees(robot, places, trees, MOTIONS), of, factors, float(LIMITS[0]))


def measured(of: Plant, trees: int, seed: int) -> ObservedRuns:
    return observe(batch(of, trees, seed), LIMITS, np.random.default_rng(seed)).thinned(3)


def small_study() -> StudyParams:
    """Parameters of small studies."""
    return StudyParams(
        plant=PlantParams(),
        motions=MOTIONS,
        compare_predictors=ComparePredictorsParams(
            robot=nominal().name, payload_kg=10, trees=10, outer_folds=2, inner_folds=2, shallow_samples=50
        ),
        evaluate_motions=EvaluateMotionsParams(
            robot=nominal().name,
            payloads_kg=[0, 10],
            training_trees=6,
            test_trees=2,
            unseen_payloads_kg=[0, 10],
            unseen_training_trees=6,
            unseen_test_trees=2,
            random_forest=ForestParams(n_estimators=100, min_samples_leaf=2, max_features=0.5),
        ),
        evaluate_robots=EvaluateRobotsParams(
            robots=["kuka_kr16_r1610_2", "ur_ur5e", "kuka_kr20_r1810_2"],
            payload_share=0.5,
            training_trees=3,
            test_trees=2,
            measured_motions=[0, 6],
        ),
        close_the_loop=load_study_params().close_the_loop,
        plan_cells=load_study_params().plan_cells,
    )
