"""A real KUKA KR300 R2500: modelled joint torques and energy against measured ones.

The figures are published (`robojoule.robots.anchors`), nothing is fitted here. The joint torque is

    tau = rigid body(q, qd, qdd) + friction(qd) + i^2 J qdd + counterbalance(q_2) on joint 2 ,

its net mechanical energy the integral of sum_j tau_j qd_j. Friction has four parts (asymmetry, viscous, Coulomb, tanh).
The counterbalance is a gas spring: a nitrogen volume pressed by a piston whose rod is hinged at a crank of joint 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from robojoule.arrays import Array
from robojoule.documents import parse
from robojoule.errors import InputError
from robojoule.motion.dynamics import inverse_dynamics
from robojoule.robots.anchors import CounterbalanceFigures, Kr300, load_kr300
from robojoule.robots.robot import Payload, Robot
from robojoule.robots.robot_file import RobotFile

JOINTS = 6


@dataclass(frozen=True)
class Recording:
    """A recorded run of T samples.

    Attributes:
        time_s: Instants, shape (T,). [s]
        position_rad: Joint positions as logged, shape (T, 6). [rad]
        velocity_rad_s: Joint velocities, shape (T, 6). [rad/s]
        motor_torque_nm: Motor torques, shape (T, 6). [Nm]
    """

    time_s: Array
    position_rad: Array
    velocity_rad_s: Array
    motor_torque_nm: Array


@dataclass(frozen=True)
class Comparison:
    """Model against measurement over one run.

    Attributes:
        modelled_nm: Joint torques of the model, shape (T, 6). [Nm]
        measured_nm: Motor torques times gear ratio, shape (T, 6). [Nm]
        modelled_j: Net mechanical energy of the model. [J]
        measured_j: Net mechanical energy measured. [J]
        positive_error_percent: Error of the energy over the instants of positive power. [%]
        r2: Coefficient of determination of each joint's torque, shape (6,). [-]
    """

    modelled_nm: Array
    measured_nm: Array
    modelled_j: float
    measured_j: float
    positive_error_percent: float
    r2: Array

    @property
    def energy_error_percent(self) -> float:
        """Error of the net mechanical energy. [%]"""
        return 100.0 * (self.modelled_j / self.measured_j - 1.0)


class Kr300Model:
    """The KR300 with the payload of the recorded runs."""

    def __init__(self) -> None:
        self.figures = load_kr300()
        runs = self.figures.runs
        # A point mass, as the source models it.
        payload = Payload(runs.payload_kg, runs.payload_com_m, np.zeros((3, 3)))
        self.robot = Robot(kr300_file(self.figures), payload)

    def torque_nm(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Joint torques.

        Args:
            q: Positions, shape (T, 6). [rad]
            qd: Velocities, shape (T, 6). [rad/s]
            qdd: Accelerations, shape (T, 6). [rad/s2]

        Returns:
            Shape (T, 6). [Nm]
        """
        torque = inverse_dynamics(self.robot, q, qd, qdd) + self.friction_nm(qd)
        torque += self.robot.drives.reflected_inertia_kg_m2 * qdd
        torque[:, 1] += counterbalance_nm(self.figures.counterbalance, q[:, 1])
        return torque

    def friction_nm(self, qd: Array) -> Array:
        """Friction torques at velocities of shape (T, 6) [rad/s]. [Nm]"""
        f = self.figures.friction
        viscous = np.array(f.viscous_nm_s_per_rad) * qd
        coulomb = np.array(f.coulomb_nm) * np.sign(qd)
        return np.asarray(np.array(f.asymmetry_nm) + viscous + coulomb + self._tanh_nm(qd))

    def _tanh_nm(self, qd: Array) -> Array:
        f = self.figures.friction
        return np.asarray(np.array(f.tanh_nm) * np.tanh(np.array(f.tanh_slope_s_per_rad) * qd))

    def compare(self, recording: Recording) -> Comparison:
        """Run the model along a recording and compare torques and energies."""
        q = recording.position_rad + np.radians(self.figures.runs.position_zero_deg)
        qd, time = recording.velocity_rad_s, recording.time_s
        modelled = self.torque_nm(q, qd, np.gradient(qd, time, axis=0))
        measured = recording.motor_torque_nm * np.array(self.figures.gear_ratio)
        power, measured_w = (modelled * qd).sum(axis=1), (measured * qd).sum(axis=1)
        positive = _integral(np.maximum(power, 0.0), time) / _integral(np.maximum(measured_w, 0.0), time)
        spread = ((measured - measured.mean(axis=0)) ** 2).sum(axis=0)
        return Comparison(
            modelled_nm=modelled,
            measured_nm=measured,
            modelled_j=_integral(power, time),
            measured_j=_integral(measured_w, time),
            positive_error_percent=100.0 * (positive - 1.0),
            r2=1.0 - ((modelled - measured) ** 2).sum(axis=0) / spread,
        )


def kr300_file(figures: Kr300) -> RobotFile:
    """The KR300 as a robot file.

    Each Denavit-Hartenberg frame stands behind its joint: the joint turns a bare link, to which the frame with the
    inertial figures is fixed. Base power and copper losses are zero, as the runs hold no electrical power; speed and
    effort limits are not published with the figures and only stand in for them (1 rad/s, 1 Nm): nothing here uses them.
    """
    links: dict[str, object] = {"base": None}
    joints: list[dict[str, object]] = []
    drives: dict[str, dict[str, float]] = {}
    dh, friction = figures.dh, figures.friction
    for j in range(JOINTS):
        name, parent = f"joint_{j + 1}", f"frame_{j}" if j else "base"
        xx, yy, zz, xy, yz, xz = figures.inertia_kg_m2_xx_yy_zz_xy_yz_xz[j]
        links[f"link_{j + 1}"] = None
        links[f"frame_{j + 1}"] = {
            "mass_kg": figures.mass_kg[j],
            "com_m": figures.com_m[j],
            "inertia_kg_m2": {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz},
        }
        lower, upper = np.radians(figures.position_limits_deg[j])
        joints += [
            {
                "name": name,
                "type": "revolute",
                "parent": parent,
                "child": f"link_{j + 1}",
                "origin_xyz_m": (0.0, 0.0, 0.0),
                # The base stands upside down: the axis of joint 1 points to the floor.
                "origin_rpy_rad": (0.0 if j else np.pi, 0.0, dh.offset_rad[j]),
                "axis": (0.0, 0.0, 1.0),
                "lower_rad": lower,
                "upper_rad": upper,
                "velocity_rad_s": 1.0,
                "effort_nm": 1.0,
            },
            {
                "name": f"{name}_frame",
                "type": "fixed",
                "parent": f"link_{j + 1}",
                "child": f"frame_{j + 1}",
                "origin_xyz_m": (dh.a_m[j], 0.0, dh.d_m[j]),
                "origin_rpy_rad": (dh.alpha_rad[j], 0.0, 0.0),
                "axis": (0.0, 0.0, 1.0),
            },
        ]
        drives[name] = {
            "gear_ratio": figures.gear_ratio[j],
            "rotor_inertia_kg_m2": figures.rotor_inertia_kg_m2[j],
            "coulomb_nm": friction.coulomb_nm[j] + friction.tanh_nm[j],
            "viscous_nm_s_per_rad": friction.viscous_nm_s_per_rad[j],
            "copper_w_per_nm2": 0.0,
        }
    data = {
        "name": "kuka_kr300_r2500",
        "vendor": "KUKA",
        "model": figures.robot,
        "rated_payload_kg": figures.rated_payload_kg,
        "source": figures.source,
        "license": figures.license,
        "root_link": "base",
        "links": links,
        "lumped_links": {"frame_6": "frame_5"},  # the flange is published without rotational inertia
        "joints": joints,
        "tool": {"parent": "frame_6", "origin_xyz_m": (0.0, 0.0, 0.0), "origin_rpy_rad": (0.0, 0.0, 0.0)},
        "home_rad": np.radians(figures.runs.position_zero_deg).tolist(),
        "drives": {
            "provenance": "identified by the source",
            "base_power_w": 0.0,
            "drive_active_power_w": 0.0,
            "inverter_efficiency": 1.0,
            "regeneration_efficiency": 0.0,
            "torque_use": 1.0,
            "torque_floor": 0.5,
            "filter_time_s": 0.05,
            "joints": drives,
        },
    }
    return parse(RobotFile, data, "anchors/kr300.json")


def counterbalance_nm(spring: CounterbalanceFigures, q2: Array) -> Array:
    """Torque that joint 2 needs against the gas spring, on top of the rigid body.

    With delta = q_2 + zero, the spring's length follows from the law of cosines, its lever from the law of sines, its
    pressure from the gas law at constant temperature.

    Args:
        spring: Published figures.
        q2: Positions of joint 2, any shape. [rad]

    Returns:
        Shape of `q2`. [Nm]
    """
    far, near = spring.pivot_to_anchor_m, spring.pivot_to_rod_m
    delta = np.asarray(q2) + np.radians(spring.zero_deg)
    length = np.sqrt(far**2 + near**2 - 2.0 * far * near * np.cos(delta))
    stroke = length - (far - near)
    area = np.pi / 4.0 * (spring.piston_diameter_m**2 - spring.rod_diameter_m**2)
    gas = spring.compressibility * spring.gas_constant_j_per_kg_k * spring.temperature_k * spring.nitrogen_kg
    lever = far * near * np.sin(delta) / length
    return np.asarray(lever * area * gas / (spring.volume_m3 - area * stroke))


def load_recording(path: str | Path, run: str | None = None) -> Recording:
    """Read a recording.

    Args:
        path: Parquet file with integers time_ms and, for j = 1..6, q<j>_mdeg, qd<j>_mdeg_per_s, motor_torque<j>_cnm
            (thousandths of degrees, hundredths of Nm: rounded like that, two runs fit in a small file).
        run: Value of the column `run`, if the file holds several.

    Raises:
        InputError: A missing or unreadable file, a missing column or run.
    """
    import pyarrow.parquet as pq

    path = Path(path)
    try:
        table = pq.read_table(path)
    except FileNotFoundError:
        raise InputError("there is no such file", file=path) from None
    except (OSError, ValueError) as error:
        raise InputError(f"the file cannot be read ({' '.join(str(error).split())})", file=path) from None

    def column(name: str) -> np.ndarray[Any, Any]:
        if name not in table.column_names:
            raise InputError("this column is missing", file=path, key=name)
        return np.asarray(table[name].to_pylist())

    rows = slice(None) if run is None else column("run") == run
    time_s = column("time_ms")[rows] / 1000.0
    if len(time_s) == 0:
        raise InputError(f"there is no run '{run}'", file=path, key="run")

    def per_joint(pattern: str) -> Array:
        return np.stack([column(pattern.format(j))[rows] for j in range(1, JOINTS + 1)], axis=1)

    return Recording(
        time_s=time_s,
        position_rad=np.radians(per_joint("q{}_mdeg") / 1000.0),
        velocity_rad_s=np.radians(per_joint("qd{}_mdeg_per_s") / 1000.0),
        motor_torque_nm=per_joint("motor_torque{}_cnm") / 100.0,
    )


def load_excerpt(run: str) -> Recording:
    """Run "a" or "b" of the committed excerpt: 10 s at 250 Hz each."""
    return load_recording(excerpt_path(), run)


def excerpt_path() -> Path:
    """File of the committed excerpt."""
    return Path(str(resources.files("reproduction.validation") / "data" / "kr300_excerpt.parquet"))


def kr300_energy_error_percent() -> float:
    """Error of the net mechanical energy over both runs of the committed excerpt together. [%]"""
    model = Kr300Model()
    results = [model.compare(load_excerpt(run)) for run in ("a", "b")]
    modelled_j = sum(result.modelled_j for result in results)
    measured_j = sum(result.measured_j for result in results)
    return 100.0 * (modelled_j / measured_j - 1.0)


def _integral(values: Array, time_s: Array) -> float:
    return float(np.trapezoid(values, time_s))
