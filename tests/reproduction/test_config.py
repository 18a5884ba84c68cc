"""The parameter file: what it holds and what it refuses."""

from pathlib import Path

import pytest
import yaml

from reproduction.config import load_params
from robojoule.errors import InputError

PARAMS = Path(__file__).parents[2] / "params.yaml"


def test_the_projects_parameters_are_valid():
    params = load_params(PARAMS)
    assert params.simulate_motions.speed_limits_percent == [10, 20, 30, 40, 50, 60, 70, 80, 90, 100]
    assert params.evaluate_plans.relaxations_percent == [110, 121, 133, 150, 175, 200]
    assert (params.generate_trees.trees, params.generate_trees.experiment_trees) == (2000, 30)


BAD = {
    "unknown section": (("nonsense",), 1, "nonsense: unknown key; allowed: .*train_predictors"),
    "unknown key": (("generate_trees", "treees"), 1, "generate_trees.treees: unknown key; allowed: .*points"),
    "robot by its path": (
        ("robot", "name"),
        "arms/own.json",
        "robot.name: 'arms/own.json' is not in the catalog .*; allowed: fanuc_crx10ia, ",
    ),
    "payload above the rated one": (
        ("robot", "payload_kg"),
        17,
        "robot.payload_kg: a payload of 17 kg is more than kuka_kr16_r2010_2 is rated for; allowed: 0 to 16 kg",
    ),
    "negative payload": (("robot", "payload_kg"), -1, "robot.payload_kg: .*greater than or equal to 0"),
    "test share": (("generate_trees", "test_fraction"), 1.5, "generate_trees.test_fraction: .*less than 1"),
    "budgets swapped": (
        ("generate_trees", "budget_rad"),
        [3, 1],
        "budget_rad: .* must be two positive numbers",
    ),
    "speeds not rising": (
        ("simulate_motions", "speed_limits_percent"),
        [10, 30, 20, 60, 100],
        "_percent: .* must rise strictly",
    ),
    "speeds not to 100": (("simulate_motions", "speed_limits_percent"), [10, 20, 30, 40, 50], "end at 100"),
    "speed above 100": (
        ("simulate_motions", "speed_limits_percent"),
        [10, 20, 30, 40, 101],
        "less than or equal to 100",
    ),
    "relaxation below 100": (("evaluate_plans", "relaxations_percent"), [90], "relaxations_percent.0: .*greater"),
    "no training tree": (
        ("train_profile_predictor", "training_trees"),
        0,
        "training_trees: .*equal to 1",
    ),
    "unknown key of the profile predictor": (
        ("train_profile_predictor", "trees"),
        60,
        "train_profile_predictor.trees: unknown key; allowed: .*runs_per_motion, training_trees",
    ),
    "few predicted speed limits": (("evaluate_plans", "predicted_speed_limits"), 9, "greater than or equal to 10"),
    "segments repeated": (("evaluate_plans", "krc_segments"), [4, 4], "krc_segments must not repeat a value"),
    "text for number": (("train_predictors", "seed"), "many", "train_predictors.seed: .*integer"),
}


@pytest.mark.parametrize("keys, value, message", BAD.values(), ids=BAD.keys())
def test_bad_parameters_are_refused_with_file_and_key(tmp_path, keys, value, message):
    data = yaml.safe_load(PARAMS.read_text())
    target = data
    for key in keys[:-1]:
        target = target[key]
    target[keys[-1]] = value
    path = tmp_path / "params.yaml"
    path.write_text(yaml.safe_dump(data))
    with pytest.raises(InputError, match=message) as caught:
        load_params(path)
    assert caught.value.file == str(path)
    assert "\n" not in str(caught.value)


def test_the_robot_carries_what_the_parameters_say_or_another_mass():
    params = load_params(PARAMS).robot
    assert params.robot().name == params.name
    assert params.robot().payload.mass_kg == params.payload_kg
    assert params.robot().payload.com_m == params.payload_com_m
    assert params.robot(0.0).payload.mass_kg == 0.0
