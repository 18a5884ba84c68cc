"""The predictor that everybody has: the one trained for the reference robot, or else the physics of an entry.

The trained one is committed beside this module; `python -m reproduction.profile_predictor.publish` writes it from the
one that the pipeline trained. It knows simulated runs only: how far its robot's catalog entry is from a machine, runs
of that machine tell (`calibrated_predictor`).
"""

from __future__ import annotations

from pathlib import Path

from robojoule.documents import load
from robojoule.errors import InputError
from robojoule.profile.predicted import ProfilePredictor, calibrated_predictor
from robojoule.profile.predictor_file import load_profile_predictor
from robojoule.robots import catalog_path
from robojoule.robots.robot import Robot
from robojoule.robots.robot_file import RobotFile

TRAINED = Path(__file__).parent / "trained"
"""Folder of a trained predictor for each robot that has one, by the robot's name."""


def reference_predictor(robot: Robot) -> ProfilePredictor:
    """Predictor of a robot of which no run is known; its `note` says what it rests on.

    Args:
        robot: Robot with any payload.

    Returns:
        The trained predictor, where there is one and the robot is the catalog's own; the physics of the robot's entry
        for others, with the wider interval that is expected of an entry.
    """
    folder = TRAINED / robot.name
    if folder.is_dir() and robot.file == load(RobotFile, catalog_path(robot.name)):
        predictor = load_profile_predictor(folder)
        try:
            predictor.check_entry(robot)
        except InputError:  # drives that were changed after loading
            return calibrated_predictor(robot)
        return predictor
    return calibrated_predictor(robot)
