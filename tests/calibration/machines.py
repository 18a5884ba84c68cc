"""A robot whose controller has joint accelerations, and what a stopwatch or a trace says of its runs."""

import numpy as np

from robojoule.calibration.run_table import MeasuredRuns
from robojoule.motion.simulation import MotionPaths
from robojoule.robots.controller_file import ControllerTiming
from tests.core_cases import kr16

RAMPS_S = np.array([0.42, 0.36, 0.3, 0.26, 0.25, 0.2])  # velocity over acceleration limit of each joint
STAMP_S = 0.004


def closed_cycle(seed=3, moves=10):
    """Motions through random configurations and back to the first one."""
    robot = kr16()
    rng = np.random.default_rng(seed)
    points = robot.home_rad + rng.uniform(-0.8, 0.8, (moves + 1, robot.joint_count))
    points[-1] = points[0]
    return MotionPaths(robot, points[:-1], points[1:]), points


def joint_controller(robot, exponent=0.0, dead_s=0.0):
    return ControllerTiming(
        rule="joint_accelerations",
        velocity_rad_s=robot.velocity_rad_s * 0.97,
        acceleration_rad_s2=robot.velocity_rad_s / RAMPS_S,
        acceleration_exponent=exponent,
        filter_time_s=0.08,
        dead_time_s=dead_s,
    )


def observed(paths, controller, limits, *, stamp_s=STAMP_S, energies=True, seed=0, noise=0.0):
    """One pass through all motions at each of some speed limits, one for all or one each."""
    machine = paths.with_controller(controller)
    rng = np.random.default_rng(seed)
    motion = np.arange(paths.motions)
    rows = []
    for limit in limits:
        each = np.broadcast_to(np.asarray(limit, dtype=float), motion.shape)
        run = machine.simulate(each[:, None])
        instants = np.append(0.0, np.cumsum(run.duration_s[:, 0])) + rng.uniform(0.0, stamp_s)
        seen = np.diff(np.floor(instants / stamp_s) * stamp_s)
        energy = run.energy_j[:, 0] * (1.0 + noise * rng.standard_normal(motion.size))
        rows.append((motion, each, seen, energy if energies else np.full(motion.size, np.nan)))
    motions, all_limits, durations, measured = (np.concatenate(column) for column in zip(*rows, strict=True))
    return MeasuredRuns("runs.csv", motions, all_limits, durations, measured, stamp_s)


def by_a_stopwatch(paths, controller, limits, step_s=0.1):
    """Each motion at each of some speed limits, its duration rounded by itself."""
    run = paths.with_controller(controller).simulate(np.tile(limits, (paths.motions, 1)))
    seconds = step_s * np.round(run.duration_s.T.ravel() / step_s)
    moves = np.tile(np.arange(paths.motions), len(limits))
    return MeasuredRuns("runs.csv", moves, np.repeat(limits, paths.motions), seconds, run.energy_j.T.ravel(), step_s)
