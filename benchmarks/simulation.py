"""Energies of motions at ten speed limits: the plain way, robojoule's, and a floor. `python -m benchmarks.simulation`.

*Plain* is the fair reference: Ruckig's `at_time` and Pinocchio's `rnea` for every 4 ms sample in a Python loop, numpy
for the power, the same model. The *floor* is what no simulation along a path can do without here: the inverse dynamics
at the fewest path nodes that keep energies within 0.1 %, by the faster of two routes (`rneaInParallel` of Pinocchio
three times per node, or the recursion along paths), and one Ruckig call per run for six joints in phase, with the
limits of the run. `ratio_to_least_floor` takes bare calls for one path coordinate instead. *Pinocchio and Ruckig* is
the same simulation with these for engines, as the stage simulate_motions runs it. Everything runs on one core,
interleaved, and is quoted as medians.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable

import numpy as np
import pinocchio as pin
from ruckig import InputParameter, Ruckig, Synchronization, Trajectory
from threadpoolctl import threadpool_limits

from robojoule.arrays import Array
from robojoule.motion.dynamics import inverse_dynamics, path_torques
from robojoule.motion.quadrature import RunQuadrature
from robojoule.motion.simulation import Engines, MotionPaths
from robojoule.robots import load_robot
from robojoule.robots.drives import mains_power_w
from robojoule.robots.recursion import path_points
from robojoule.robots.robot import Payload, Robot

SPEED_LIMITS = np.arange(1, 11) / 10.0
SAMPLE_S = 0.004
ALLOWED_DEVIATION = 1e-3


def random_motions(robot: Robot, count: int) -> tuple[Array, Array]:
    """Starts and ends of random motions of the pipeline's size, each of shape (count, n). [rad]"""
    rng = np.random.default_rng(5)
    start = robot.home_rad + rng.normal(0.0, 0.3, (count, robot.joint_count))
    change = rng.dirichlet(np.ones(robot.joint_count), count) * rng.uniform(2.1, 4.5, (count, 1))
    end = start + change * rng.choice([-1.0, 1.0], change.shape)
    return tuple(np.clip(x, robot.lower_rad, robot.upper_rad) for x in (start, end))  # type: ignore[return-value]


def phase_problem(delta: Array, velocity: float, acceleration: float, filter_time_s: float) -> InputParameter:
    """Ruckig's problem of joints that move in phase."""
    problem = InputParameter(len(delta))
    problem.target_position = delta
    problem.max_velocity = np.abs(delta) * velocity
    problem.max_acceleration = np.abs(delta) * acceleration
    problem.max_jerk = np.abs(delta) * acceleration / filter_time_s
    problem.synchronization = Synchronization.Phase
    return problem


def plain_run(paths: MotionPaths, motion: int, velocity: float, acceleration: float) -> tuple[float, float]:
    """Duration [s] and energy [J] of one run, sample by sample."""
    robot, delta = paths.robot, paths.delta_rad[motion]
    drives, data = robot.drives, robot.model.createData()
    trajectory = Trajectory(robot.joint_count)
    problem = phase_problem(delta, velocity, acceleration, drives.filter_time_s)
    Ruckig(robot.joint_count).calculate(problem, trajectory)
    instants = np.append(np.arange(0.0, trajectory.duration, SAMPLE_S), trajectory.duration)
    power = np.empty(len(instants))
    for k, instant in enumerate(instants):
        q, qd, qdd = trajectory.at_time(instant)
        qd, qdd = np.asarray(qd), np.asarray(qdd)
        load = pin.rnea(robot.model, data, paths.start_rad[motion] + q, qd, qdd)
        load += drives.reflected_inertia_kg_m2 * qdd
        torque = load + drives.friction_nm(np.sign(delta), qd, load)
        power[k] = torque @ qd + drives.copper_w_per_joint_nm2 @ torque**2
    return trajectory.duration, float(np.trapezoid(mains_power_w(drives, power), instants))


def plain_runs(paths: MotionPaths, motions: range) -> Array:
    """Durations and energies of motions at all speed limits, shape (2, motions, S)."""
    peaks = paths.peak_velocities(SPEED_LIMITS)[list(motions)]
    accelerations = paths.timing.acceleration[list(motions)]
    runs = [
        [plain_run(paths, motion, v, a) for v in vs]
        for motion, vs, a in zip(motions, peaks.tolist(), accelerations.tolist(), strict=True)
    ]
    return np.array(runs).transpose(2, 0, 1)


class CoarsePaths(MotionPaths):
    """Motions with a number of path nodes that need not be enough."""

    def __init__(self, paths: MotionPaths, count: int) -> None:
        super().__init__(paths.robot, paths.start_rad, paths.start_rad + paths.delta_rad)
        self.torques = path_torques(self.robot, self.path, count)

    def _quadrature(self, path_nodes: int) -> RunQuadrature:
        return super()._quadrature(21)


def fewest_nodes(paths: MotionPaths) -> int:
    """Fewest path nodes with which no energy is off by more than 0.1 %."""
    exact = paths.simulate(SPEED_LIMITS).energy_j
    for count in range(4, 40):
        energy = CoarsePaths(paths, count).simulate(SPEED_LIMITS).energy_j
        if np.abs(energy / exact - 1.0).max() <= ALLOWED_DEVIATION:
            return count
    raise RuntimeError("no number of nodes is enough")


def parallel_calls(robot: Robot, q: Array) -> None:
    """Three inverse-dynamics calls a path point (n, N) by Pinocchio."""
    for _ in range(3):
        inverse_dynamics(robot, q.T, q.T, q.T, engine="pinocchio")


def recursion_calls(robot: Robot, q: Array) -> None:
    """The same by the recursion along paths."""
    path_points(robot.mechanism, q, q)


def trajectory_calls(joints: int, motions: int) -> None:
    """One Ruckig call a run, into objects made before."""
    generator, trajectory = Ruckig(joints), Trajectory(joints)
    problem = phase_problem(np.linspace(0.5, 1.0, joints), 1.0, 5.0, 0.1)
    delta: list[float] = np.linspace(0.5, 1.0, joints).tolist()  # Ruckig reads lists faster than arrays
    for _ in range(motions):
        problem.target_position = delta
        for limit in SPEED_LIMITS.tolist():
            problem.max_velocity = [limit * change for change in delta]
            problem.max_acceleration = [5.0 * change for change in delta]
            problem.max_jerk = [50.0 * change for change in delta]
            generator.calculate(problem, trajectory)


def bare_trajectory_calls(motions: int) -> None:
    """The same for the one path coordinate, and nothing but the velocity limit changes."""
    generator, trajectory = Ruckig(1), Trajectory(1)
    problem = phase_problem(np.ones(1), 1.0, 5.0, 0.1)
    for _ in range(motions):
        for limit in SPEED_LIMITS:
            problem.max_velocity = [limit]
            generator.calculate(problem, trajectory)


def seconds(work: Callable[[], object]) -> float:
    """Processor time of one call. [s]"""
    start = time.process_time()
    work()
    return time.process_time() - start


def fine_reference(paths: MotionPaths, motions: range) -> Array:
    """Energies by the trapezoid rule at 4 kHz, shape (len(motions), S). [J]"""
    return np.array(
        [
            [np.trapezoid(s.power_w, s.time_s) for s in (paths.sample(m, p, 4000.0) for p in SPEED_LIMITS)]
            for m in motions
        ]
    )


def measure(motions: int, plain_motions: int, rounds: int) -> dict[str, float]:
    """Run the comparison; times are per motion at ten speed limits."""
    robot = load_robot("kuka_kr16_r2010_2", Payload(10.0))
    start, end = random_motions(robot, motions)
    paths = MotionPaths(robot, start, end)
    runs = paths.simulate(SPEED_LIMITS)
    nodes = fewest_nodes(MotionPaths(robot, start[:60], end[:60]))
    points = np.ascontiguousarray(np.repeat(start, nodes, axis=0).T)
    checked = range(0, motions, max(motions // 20, 1))
    reference = fine_reference(paths, checked)
    duration, energy = plain_runs(paths, range(plain_motions))
    dense, part = np.linspace(0.1, 1.0, 91), slice(0, max(motions // 5, 1))
    works: dict[str, tuple[Callable[[], object], int]] = {
        "robojoule": (lambda: MotionPaths(robot, start, end).simulate(SPEED_LIMITS), motions),
        "robojoule_91": (lambda: MotionPaths(robot, start[part], end[part]).simulate(dense), part.stop),
        "pinocchio_and_ruckig": (
            lambda: MotionPaths(robot, start, end, engines=Engines("pinocchio", "ruckig")).simulate(SPEED_LIMITS),
            motions,
        ),
        "plain": (lambda: plain_runs(paths, range(plain_motions)), plain_motions),
        "rnea_in_parallel": (lambda: parallel_calls(robot, points), motions),
        "recursion": (lambda: recursion_calls(robot, points), motions),
        "ruckig_joints": (lambda: trajectory_calls(robot.joint_count, motions), motions),
        "ruckig_path": (lambda: bare_trajectory_calls(motions), motions),
    }
    rounds_s = [{name: seconds(work) / count for name, (work, count) in works.items()} for _ in range(rounds)]
    times = {name: np.array([one[name] for one in rounds_s]) for name in works}
    dynamics = min(times["rnea_in_parallel"], times["recursion"], key=np.median)
    ratios = {
        "speedup_over_plain": times["plain"] / times["robojoule"],
        "ratio_to_floor": times["robojoule"] / (dynamics + times["ruckig_joints"]),
        "ratio_to_least_floor": times["robojoule"] / (dynamics + times["ruckig_path"]),
        "pinocchio_and_ruckig_over_own": times["pinocchio_and_ruckig"] / times["robojoule"],
        "cost_of_91_over_10_speed_limits": times["robojoule_91"] / times["robojoule"],
    }
    return {
        **{name: round(float(np.median(ratio)), 3) for name, ratio in ratios.items()},
        "max_energy_deviation": float(np.abs(runs.energy_j[list(checked)] / reference - 1.0).max()),
        "max_duration_deviation_s": float(np.abs(runs.duration_s[:plain_motions] - duration).max()),
        "max_plain_energy_deviation": float(np.abs(energy / runs.energy_j[:plain_motions] - 1.0).max()),
        "floor_nodes": nodes,
        **{f"{name}_ms_per_motion": round(1e3 * float(np.median(values)), 4) for name, values in times.items()},
    }


def main() -> None:
    """Print one JSON line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer motions and rounds, under 40 s")
    arguments = parser.parse_args()
    with threadpool_limits(1):
        result = measure(600, 5, 5) if arguments.quick else measure(1000, 20, 9)
    print(json.dumps(result))


if __name__ == "__main__":
    main()
