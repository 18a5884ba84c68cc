"""Energies of motions at ten speed limits: the plain way, robojoule's, and a floor. `python -m benchmarks.simulation`.

*Plain* is the fair reference: Ruckig's `at_time` and Pinocchio's `rnea` for every 4 ms sample in a Python loop, numpy
for the power, the same model. The *floor* is what no simulation along a path can do without here: the inverse-dynamics
calls at the fewest path nodes that keep energies within 0.1 %, in the fastest route of Pinocchio's Python package
(`rneaInParallel`), and one Ruckig call a run. Everything runs on one core, interleaved, and is quoted as medians.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pinocchio as pin
from ruckig import InputParameter, Ruckig, Synchronization, Trajectory
from threadpoolctl import threadpool_limits

from robojoule.documents import write_document
from robojoule.drive import Array, mains_power_w
from robojoule.dynamics import inverse_dynamics, path_torques
from robojoule.quadrature import run_quadrature
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload, Robot
from robojoule.simulation import MotionPaths
from robojoule.trajectory import path_law

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


def plain_energies(paths: MotionPaths, motion: int) -> Array:
    """Energies of one motion at all speed limits, sample by sample. [J]"""
    robot, delta = paths.robot, paths.delta_rad[motion]
    drives, data = robot.drives, robot.model.createData()
    peaks = paths.peak_velocities(SPEED_LIMITS)[motion]
    accelerations = paths.timing.acceleration(peaks[None], np.array([motion]))[0]
    energies = np.empty(len(peaks))
    for run, (velocity, acceleration) in enumerate(zip(peaks, accelerations, strict=True)):
        problem = InputParameter(robot.joint_count)
        problem.target_position = delta
        problem.max_velocity = np.abs(delta) * velocity
        problem.max_acceleration = np.abs(delta) * acceleration
        problem.max_jerk = np.abs(delta) * acceleration / drives.filter_time_s
        problem.synchronization = Synchronization.Phase
        trajectory = Trajectory(robot.joint_count)
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
        energies[run] = np.trapezoid(mains_power_w(drives, power), instants)
    return energies


def fewest_nodes(paths: MotionPaths) -> int:
    """Fewest path nodes with which no energy is off by more than 0.1 %."""
    exact = paths.simulate(SPEED_LIMITS).energy_j
    for count in range(4, 40):
        coarse = MotionPaths(paths.robot, paths.start_rad, paths.start_rad + paths.delta_rad)
        coarse.torques = path_torques(paths.robot, paths.start_rad, paths.delta_rad, count)
        coarse._quadrature = lambda _: run_quadrature(21)  # type: ignore[method-assign]
        if np.abs(coarse.simulate(SPEED_LIMITS).energy_j / exact - 1.0).max() <= ALLOWED_DEVIATION:
            return count
    raise RuntimeError("no number of nodes is enough")


def floor_work(paths: MotionPaths, nodes: int) -> None:
    """The calls of the floor for all motions."""
    count = paths.motions * nodes
    q = np.resize(paths.start_rad, (count, paths.robot.joint_count))
    for _ in range(3):
        inverse_dynamics(paths.robot, q, q, q)
    for travel in paths.timing.travel_rad:
        for limit in SPEED_LIMITS:
            path_law(float(travel), float(limit), 5.0, 100.0)


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
    checked = range(0, motions, max(motions // 20, 1))
    deviation = float(np.abs(runs.energy_j[list(checked)] / fine_reference(paths, checked) - 1.0).max())
    dense = np.linspace(0.1, 1.0, 91)
    ours, plain, floor, many = [], [], [], []
    for _ in range(rounds):
        ours.append(seconds(lambda: MotionPaths(robot, start, end).simulate(SPEED_LIMITS)) / motions)
        plain.append(seconds(lambda: [plain_energies(paths, m) for m in range(plain_motions)]) / plain_motions)
        floor.append(seconds(lambda: floor_work(paths, nodes)) / motions)
        part = slice(0, max(motions // 5, 1))
        many.append(seconds(lambda part=part: MotionPaths(robot, start[part], end[part]).simulate(dense)) / part.stop)
    ratios = {
        "speedup_over_plain": float(np.median(np.array(plain) / ours)),
        "ratio_to_floor": float(np.median(np.array(ours) / floor)),
        "cost_of_91_over_10_speed_limits": float(np.median(np.array(many) / ours)),
    }
    return {
        **{name: round(value, 3) for name, value in ratios.items()},
        "max_energy_deviation": deviation,
        "floor_nodes": nodes,
        "ours_ms_per_motion": round(1e3 * float(np.median(ours)), 4),
        "plain_ms_per_motion": round(1e3 * float(np.median(plain)), 3),
        "floor_ms_per_motion": round(1e3 * float(np.median(floor)), 4),
    }


def main() -> None:
    """Print one JSON line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer motions and rounds, under 40 s")
    parser.add_argument("--out", type=Path, help="also write the result with machine and versions here (JSON)")
    arguments = parser.parse_args()
    with threadpool_limits(1):
        result = measure(300, 3, 3) if arguments.quick else measure(1000, 10, 5)
    print(json.dumps(result))
    if arguments.out:
        machine = {"processor": platform.machine(), "cores": os.cpu_count(), "python": platform.python_version()}
        versions = {name: version(name) for name in ("numpy", "pin", "ruckig", "robojoule")}
        write_document(arguments.out, {"machine": machine, "versions": versions, "simulation": result})


if __name__ == "__main__":
    main()
