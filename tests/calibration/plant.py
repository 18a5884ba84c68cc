"""A machine to identify: its own dynamics and electrical model with hidden parameters and effects no model knows.

Written from the equations, apart from the library's drive model: inverse dynamics with wrong inertias, friction that
grows with the load, a DC bus with its two regimes, noise. The trajectories are the library's (what a controller
commands does not depend on what the machine draws).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from robojoule.calibration.log import MeasuredLog
from robojoule.motion.dynamics import inverse_dynamics
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import load_robot
from robojoule.robots.drives import mains_power_w
from robojoule.robots.robot import Payload

ROBOT = "kuka_kr16_r2010_2"


@dataclass
class Plant:
    """Hidden truth, drawn from a seed."""

    seed: int
    inertia_error: float = 0.05
    load_friction: float = 0.03  # Nm of friction per Nm of load
    regeneration: float = 0.0
    active_w: float = 25.0
    name: str = ROBOT
    hidden: dict = field(init=False)

    def __post_init__(self):
        rng = np.random.default_rng(self.seed)
        drives = load_robot(self.name).drives
        n = len(drives.gear_ratio)
        self.rotor = drives.reflected_inertia_kg_m2
        self.gear = drives.gear_ratio
        self.hidden = {
            "base": drives.base_power_w * rng.uniform(0.8, 1.2),
            "active": self.active_w,
            "eta": rng.uniform(0.82, 0.94),
            "rho": self.regeneration,
            "coulomb": drives.coulomb_nm * rng.uniform(0.6, 1.5, n),
            "viscous": drives.viscous_nm_s_per_rad * rng.uniform(0.6, 1.5, n),
            "copper": drives.copper_w_per_nm2 * rng.uniform(0.6, 1.5, n),
        }
        self.mass_factor = 1.0 + self.inertia_error * rng.choice([-1.0, 1.0], n)

    def _model(self, payload_kg):
        pin = pytest.importorskip("pinocchio")
        model = load_robot(self.name, Payload(0.0)).model
        for joint in range(1, model.njoints):
            inertia = model.inertias[joint]
            factor = self.mass_factor[joint - 1]
            model.inertias[joint] = pin.Inertia(inertia.mass * factor, inertia.lever, inertia.inertia * factor)
        loaded = load_robot(self.name, Payload(payload_kg)).model
        bare = load_robot(self.name, Payload(0.0)).model
        last = model.njoints - 1
        if payload_kg:
            model.inertias[last] = model.inertias[last] + (loaded.inertias[last] - bare.inertias[last])
        return model

    def torque_and_power(self, q, qd, qdd, payload_kg):
        """Link-side torques (T, n) and noise-free mains power (T,)."""
        pin = pytest.importorskip("pinocchio")
        model, h = self._model(payload_kg), self.hidden
        data = model.createData()
        torque, power = np.empty_like(q), np.empty(len(q))
        for t in range(len(q)):
            load = pin.rnea(model, data, q[t], qd[t], qdd[t])
            friction = (h["coulomb"] + self.load_friction * np.abs(load)) * np.sign(qd[t]) + h["viscous"] * qd[t]
            tau = load + self.rotor * qdd[t] + friction
            bus = float(tau @ qd[t] + h["copper"] @ (tau / self.gear) ** 2)
            moving = bool(np.any(qd[t] != 0.0))
            mains = bus / h["eta"] if bus > 0 else h["rho"] * bus
            torque[t], power[t] = tau, h["base"] + h["active"] * moving + mains
        return torque, power


def trajectory(seed, motions, *, rate_hz=250.0, jitter=0.0, payload_kg=10.0, rest_s=0.4, name=ROBOT, joints=None):
    """Times, states and motion numbers of random motions with rests: t, q, qd, qdd (T, n), motion (T,)."""
    rng = np.random.default_rng(seed)
    robot = load_robot(name, Payload(payload_kg))
    n = robot.joint_count
    joints = list(range(n)) if joints is None else joints
    lower, upper = np.maximum(robot.lower_rad, -2.2), np.minimum(robot.upper_rad, 2.2)
    configurations = [robot.home_rad.copy()]
    while len(configurations) <= motions:
        target = configurations[-1].copy()
        for j in joints:
            if len(joints) == 1 or rng.random() < 0.6:
                middle = robot.home_rad[j] if lower[j] < robot.home_rad[j] < upper[j] else (lower[j] + upper[j]) / 2
                target[j] = np.clip(middle + rng.uniform(-1.2, 1.2), lower[j], upper[j])
        if np.abs(target - configurations[-1]).max() > 0.2:
            configurations.append(target)
    points = np.array(configurations)
    paths = MotionPaths(robot, points[:-1], points[1:])
    limits = rng.choice([0.15, 0.3, 0.5, 0.7, 1.0], motions)
    velocity = paths.peak_velocities(limits[:, None])[:, 0]
    laws = [paths.law(i, float(velocity[i])) for i in range(motions)]
    starts = np.cumsum([rest_s] + [law.total_s + rest_s for law in laws])
    count = int(starts[-1] * rate_hz)
    time = np.arange(count) / rate_hz
    if jitter:
        time = np.sort(time + rng.uniform(-jitter, jitter, count) / rate_hz)
        time -= time[0]
    q, qd, qdd = (np.zeros((count, n)) for _ in range(3))
    motion = np.full(count, -1)
    position = points[0]
    filled = 0
    for i, law in enumerate(laws):
        first, last = np.searchsorted(time, [starts[i], starts[i] + law.total_s])
        q[filled:first] = position
        s, s1, s2, _ = law.at(time[first:last] - starts[i])
        delta = paths.delta_rad[i]
        q[first:last] = points[i] + s[:, None] * delta
        qd[first:last], qdd[first:last] = s1[:, None] * delta, s2[:, None] * delta
        motion[first:last] = i
        position, filled = points[i + 1], last
    q[filled:] = position
    return time, q, qd, qdd, motion


def make_log(plant, seed, motions=40, *, noise=0.02, encoder_rad=1e-5, torques=False, **options):
    """A log as columns (dict of arrays) and the noise-free power (T,)."""
    payload = options.get("payload_kg", 10.0)
    time, q, qd, qdd, _ = trajectory(seed, motions, name=plant.name, **options)
    torque, power = plant.torque_and_power(q, qd, qdd, payload)
    rng = np.random.default_rng([seed, 1])
    columns = {"time_s": time}
    measured = np.round(q / encoder_rad) * encoder_rad if encoder_rad else q
    for joint in range(q.shape[1]):
        columns[f"q{joint + 1}_rad"] = measured[:, joint]
    if torques:
        effort = load_robot(plant.name).effort_nm
        noisy = torque + 0.005 * effort * rng.standard_normal(torque.shape)
        for joint in range(q.shape[1]):
            columns[f"q{joint + 1}_torque_nm"] = noisy[:, joint]
    columns["power_w"] = power * (1.0 + noise * rng.standard_normal(len(power)))
    return columns, power


def as_log(columns, source="log", joints=6):
    """The columns as a checked log would hold them."""
    torque = None
    if "q1_torque_nm" in columns:
        torque = np.stack([columns[f"q{j}_torque_nm"] for j in range(1, joints + 1)], axis=1)
    position = np.stack([columns[f"q{j}_rad"] for j in range(1, joints + 1)], axis=1)
    return MeasuredLog(source, columns["time_s"], position, columns["power_w"], torque_nm=torque)


def predicted_power(robot, q, qd, qdd):
    """Mains power (T,) that a robot's drive model predicts, from the equations of the library's `drive` module."""
    drives = robot.drives
    load = inverse_dynamics(robot, q, qd, qdd) + drives.reflected_inertia_kg_m2 * qdd
    torque = load + drives.coulomb_nm * np.sign(qd) + drives.viscous_nm_s_per_rad * qd
    bus = (torque * qd).sum(axis=1) + torque**2 @ drives.copper_w_per_joint_nm2
    moving = np.any(qd != 0.0, axis=1)
    return mains_power_w(drives, bus) - drives.drive_active_power_w * ~moving


def judge(plant, robot, seed, motions=25, payload_kg=10.0):
    """Errors against noise-free power on fresh motions: RMSE over mean power, and of each motion's energy. [%]"""
    _, q, qd, qdd, motion = trajectory(seed, motions, payload_kg=payload_kg, name=plant.name)
    _, true = plant.torque_and_power(q, qd, qdd, payload_kg)
    model = predicted_power(robot, q, qd, qdd)
    rmse = 100.0 * np.sqrt(np.mean((model - true) ** 2)) / true.mean()
    energies = [(model[motion == i].sum(), true[motion == i].sum()) for i in range(motions)]
    each = np.array([100.0 * (m / t - 1.0) for m, t in energies])
    total = 100.0 * (sum(m for m, _ in energies) / sum(t for _, t in energies) - 1.0)
    return rmse, total, each
