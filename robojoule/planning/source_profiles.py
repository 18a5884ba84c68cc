"""Energy profiles of single motions from any source: simulated, predicted, or measured runs of a program's moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, frozen
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.calibration.timing import rule_doubts
from robojoule.calibration.timing_fit import OF_STAMPS
from robojoule.errors import InputError
from robojoule.inputs import unknown_name
from robojoule.motion.blends import BlendedPaths
from robojoule.motion.simulation import MotionPaths
from robojoule.motion.tool_motions import ToolMotions
from robojoule.planning.batch import TreeBatch
from robojoule.planning.learnt_timing import with_learnt_timing
from robojoule.planning.measured_plans import check_measured
from robojoule.planning.optimization import Profiles
from robojoule.planning.tree_motions import chains_of_tree, check_single_moves, tree_payloads
from robojoule.profile.energy_profile import (
    SLOWEST_SPEED_LIMIT,
    EnergyProfile,
    check_points,
    profile_of,
    simulated_profile,
)
from robojoule.profile.measured import measured_profiles
from robojoule.profile.predicted import NORMAL_QUANTILE, ProfilePredictor
from robojoule.profile.reference import reference_predictor
from robojoule.profile.sampled import sampled_profile
from robojoule.programs.tool_moves import tool_moves_of_tree
from robojoule.robots.robot import Robot


def motion_profile(
    robot: Robot,
    start_rad: ArrayLike,
    end_rad: ArrayLike,
    points: int,
    profiles: Profiles,
    predictor: ProfilePredictor | None = None,
) -> EnergyProfile:
    """The profile of a motion as it is simulated or predicted; torques are simulated ones.

    Args:
        robot: Robot with its payload.
        start_rad: Start configuration, shape (n,). [rad]
        end_rad: End configuration, shape (n,). [rad]
        points: Number of equidistant speed limits from 10 to 100 %.
        profiles: Where durations and energies come from; predicted ones have an interval.
        predictor: What predicts profiles; the reference of the robot if None.

    Raises:
        InputError: Not as many points as allowed, or no motion.
    """
    simulated = simulated_profile(robot, start_rad, end_rad, points)
    if profiles == "simulated":
        return simulated
    limits = np.linspace(SLOWEST_SPEED_LIMIT, 1.0, points)
    found = (predictor or reference_predictor(robot)).predict(MotionPaths(robot, start_rad, end_rad), limits)
    believed = _believed(
        simulated, limits, found.duration_s[0], found.energy_j[0], found.lower_j[0], found.upper_j[0], "predicted"
    )
    return replace(
        believed, idle_power_start_w=float(found.idle_start_w[0]), idle_power_end_w=float(found.idle_end_w[0])
    )


def move_profile(
    batch: TreeBatch,
    move: object,
    points: int,
    profiles: Profiles,
    runs: MeasuredRuns | None,
    predictor: ProfilePredictor | None = None,
) -> EnergyProfile:
    """The profile of one move of a program.

    Args:
        batch: The one tree of the program.
        move: Name of the move.
        points: Number of equidistant speed limits from 10 to 100 %; measured profiles have those of the runs as well,
            and end near the lowest of them.
        profiles: Where energies and durations come from; with runs, simulated ones take the timing from them.
        runs: Measured runs of the program's moves, if there are any.
        predictor: What predicts profiles; the reference of the robot if None.

    Raises:
        InputError: There is no such move, it goes nowhere, or a run of it is missing.
    """
    tree, names = batch.trees[0], [one.name for one in batch.trees[0].moves()]
    if not isinstance(move, str):
        raise InputError("which move of the program is not said", key="move", allowed=", ".join(names))
    if move not in names:
        error = unknown_name("move", move, names)
        raise InputError(error.problem, key="move", allowed=error.allowed)
    check_points(points)
    vertices = batch.graphs[0].vertices
    vertex = next(place for place, one in enumerate(vertices) if move in one.moves)
    payload = tree_payloads(batch.robot, tree)[vertex]
    robot = batch.robot if payload == batch.robot.payload else batch.robot.carrying(payload)
    row = names.index(move)
    if len(vertices[vertex].moves) > 1 or tree.moves()[row].tool_path is not None:
        if runs is not None:
            check_single_moves(tree)
        return _whole_profile(robot, batch, vertex, points, profiles)
    start, end = tree.configurations_rad()[row : row + 2]
    if runs is None:
        return motion_profile(robot, start, end, points, profiles, predictor)
    if profiles == "simulated":
        learnt, doubts = with_learnt_timing(batch, runs)
        by_runs = simulated_profile(robot.variant(controller=learnt.robot.controller), start, end, points)
        return replace(by_runs, doubts=(*by_runs.doubts, *doubts))
    if profiles == "measured":
        check_measured(batch, runs, [row])
    own = np.unique(runs.speed_limits[runs.motion == row])
    limits = np.unique(np.append(np.linspace(SLOWEST_SPEED_LIMIT, 1.0, points), own))
    found = measured_profiles(batch.paths, runs, limits)
    shared = np.einsum(
        "sp,pq,sq->s", found.energy_gradient_j[row], found.energy_covariance, found.energy_gradient_j[row]
    )
    margin = NORMAL_QUANTILE * np.sqrt(np.maximum(shared, 0.0) + found.energy_deviation_j[row] ** 2)
    known, energy = found.allowed[row], found.energy_j[row]
    simulated = simulated_profile(robot.variant(controller=found.controller), start, end, points)
    believed = _believed(
        simulated,
        limits[known],
        found.duration_s[row][known],
        energy[known],
        (energy - margin)[known],
        (energy + margin)[known],
        profiles,
    )
    distinct = np.searchsorted(limits, believed.speed_limits)
    # Where a duration was measured, what the rule does not tell is known but for the stamps; coarse ones add nothing.
    single_s = found.single_deviations_s(row)
    stamped_s = np.maximum(found.duration_deviation_s[row], OF_STAMPS * runs.resolution_s)
    deviation_s = np.where(np.isin(limits, own), np.minimum(stamped_s, single_s), single_s)
    around_s = NORMAL_QUANTILE * deviation_s[distinct]
    return replace(
        believed,
        low_s=frozen(np.maximum(believed.durations_s - around_s, 0.0)),
        high_s=frozen(believed.durations_s + around_s),
        doubts=(*believed.doubts, *rule_doubts(found.held_out_error, runs)),
        measured_speed_limits=frozen(own),
        rule=found.rule,
        idle_power_start_w=float(found.idle_start_w[row]),
        idle_power_end_w=float(found.idle_end_w[row]),
    )


def _whole_profile(robot: Robot, batch: TreeBatch, vertex: int, points: int, profiles: Profiles) -> EnergyProfile:
    """The profile of a motion through coarse zones, all of its moves at the same speed limit, or of the tool."""
    tree = batch.trees[0]
    names, of_tool = batch.graphs[0].vertices[vertex].moves, tool_moves_of_tree(tree)[vertex]
    said = [f"the profile is that of the whole motion through '{names[0]}' to '{names[-1]}'"] if of_tool is None else []
    if profiles == "predicted":
        said.append("it is simulated: predictors know straight motions only")
    if of_tool is not None:
        found = profile_of(robot, ToolMotions(robot, [of_tool]), points)
    else:
        found = profile_of(robot, BlendedPaths(robot, [chains_of_tree(tree)[vertex]]), points)
    return replace(found, doubts=(*found.doubts, *said))


def _believed(
    simulated: EnergyProfile,
    limits: Array,
    duration_s: Array,
    energy_j: Array,
    low_j: Array,
    high_j: Array,
    profiles: Profiles,
) -> EnergyProfile:
    """A simulated profile with durations and energies of another source, all of shape (S,); torques stay."""
    distinct = sampled_profile(duration_s, energy_j, limits)
    rows = np.searchsorted(limits, distinct.speed_limits[::-1])
    return replace(
        simulated,
        speed_limits=frozen(limits[rows]),
        durations_s=frozen(duration_s[rows]),
        energies_j=frozen(energy_j[rows]),
        parts_j={},
        profiles=profiles,
        low_j=frozen(low_j[rows]),
        high_j=frozen(high_j[rows]),
    )
