"""Energy over duration of single motions: the task of `energy_profile`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import as_array
from robojoule.calls import finite
from robojoule.checks import checked_batch, checked_robot, checked_runs, known_program, model_program
from robojoule.errors import InputError
from robojoule.formats.program import Program
from robojoule.inputs import as_flag
from robojoule.planning.optimization import Profiles, checked_profiles
from robojoule.planning.source_profiles import motion_profile, move_profile
from robojoule.profile.energy_profile import EnergyProfile
from robojoule.profile.predictor_file import load_profile_predictor
from robojoule.robots.robot import Robot

if TYPE_CHECKING:
    from robojoule.calibration.run_table import MeasuredRuns


@finite
def energy_profile(
    robot: Robot,
    start: ArrayLike | None = None,
    end: ArrayLike | None = None,
    *,
    program: Program | None = None,
    move: str | None = None,
    points: int = 19,
    degrees: bool = False,
    profiles: Profiles | None = None,
    model: str | Path | None = None,
    runs: str | Path | MeasuredRuns | None = None,
) -> EnergyProfile:
    """Energy over duration of a motion, or of a move of a program, at equidistant speed limits from 10 to 100 %.

    Args:
        robot: Robot with its payload.
        start: Start configuration, shape (n,). [rad]
        end: End configuration, shape (n,). [rad]
        program: Program whose move is meant, in the place of start and end.
        move: Name of that move.
        points: Number of speed limits, 2 to 1000.
        degrees: Whether the configurations are in degrees instead.
        profiles: Where energies and durations come from; see `optimize`. Measured ones end near the lowest speed limit.
        model: Folder of a trained predictor; see `optimize`.
        runs: Measured runs of the program's moves; see `optimize`.

    Raises:
        InputError: A configuration does not fit the robot, there is no motion or no such move, or runs are missing.
    """
    robot, in_degrees = checked_robot(robot), as_flag(degrees, "degrees")
    source = checked_profiles(profiles, with_runs=runs is not None, cautious=False, with_model=model is not None)
    predictor = None if model is None else load_profile_predictor(model)
    if program is None and move is None and runs is None and not (start is None and end is None):
        ends = [as_array(q, where, "joint positions") for q, where in ((start, "start"), (end, "end"))]
        first, last = (
            robot.check_configuration(np.radians(q) if in_degrees else q, where)
            for q, where in zip(ends, ("start", "end"), strict=True)
        )
        return motion_profile(robot, first, last, points, source, predictor)
    if program is None or start is not None or end is not None:
        problem = "a profile is that of a motion or of a move of a program"
        raise InputError(problem, key="program", allowed="start and end, or program and move")
    program = model_program(known_program(program, robot), robot)
    known = None if runs is None else checked_runs(runs, program)
    return move_profile(checked_batch(program, robot), move, points, source, known, predictor)
