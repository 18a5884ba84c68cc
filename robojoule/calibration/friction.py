"""Friction and inertia of the joints from torques or motor currents alone, where no power was measured.

Where a joint slides in one direction, with the rigid-body and rotor torque l of the robot's file,

    tau = m l + C sign(qd) + B qd + o .

m is 1 where inertia, payload and, for currents, torque constants fit; o is an offset of the sensor. Windows of the log
are fitted joint by joint by robust least squares; every fourth motion takes no part, and its torques are the score.
Copper loss, base power and efficiencies cannot be seen without power: they stay as they are in the file.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from robojoule.arrays import Array, Index
from robojoule.calibration.identification import wider_for_few
from robojoule.calibration.log import MeasuredLog
from robojoule.calibration.log_fit import HUBER, MAD_TO_SIGMA
from robojoule.calibration.log_motions import log_timing
from robojoule.calibration.signals import Signals, prepare
from robojoule.calibration.timing import TimingIdentification, timing_warnings, with_timing
from robojoule.documents import parse
from robojoule.errors import InputError
from robojoule.robots.robot import Robot
from robojoule.robots.robot_file import RobotFile

FEWEST_WINDOWS = 20
SLIDES = 0.999  # mean direction of a window in which a joint does not turn round
WELL_KNOWN = 0.5  # standard error over the figure above which it is not told
POOR_SCALE = 0.1  # by which the share of the file's torque may differ from 1 before people are told
_ITERATIONS = 30
_SIGNIFICANT_DIGITS = 5


@dataclass(frozen=True)
class JointFriction:
    """What torques tell of one joint.

    Attributes:
        joint: Its name.
        coulomb_nm: Coulomb friction; the file's where it is not told. [Nm]
        coulomb_error_nm: Standard error; None where it is not told. [Nm]
        viscous_nm_s_per_rad: Viscous friction; the file's where it is not told. [Nm s/rad]
        viscous_error_nm_s_per_rad: Standard error; None where it is not told. [Nm s/rad]
        torque_scale: Measured torque over that of the file's inertia, rotor and payload. [-]
        torque_scale_error: Standard error. [-]
        r2: Share of the variance of torques that is explained: of motions left out, or of all where they say too
            little of this joint. [-]
        identified: Whether both frictions are told, with errors below half of themselves; that of viscous friction may
            be half of Coulomb friction at the fastest speed.
    """

    joint: str
    coulomb_nm: float
    coulomb_error_nm: float | None
    viscous_nm_s_per_rad: float
    viscous_error_nm_s_per_rad: float | None
    torque_scale: float
    torque_scale_error: float
    r2: float
    identified: bool


@dataclass(frozen=True, eq=False)
class FrictionIdentification:
    """What torques or currents of a log tell, and the timing of its motions.

    Attributes:
        robot: Robot that the fit started from.
        source: The log.
        joints: What is told of each joint.
        timing: The controller's timing by the log's motions, if they tell it.
        no_timing: Why they do not tell it, a sentence.
        log_warnings: What to know about the log itself, a sentence each.
    """

    robot: Robot
    source: str
    joints: tuple[JointFriction, ...]
    timing: TimingIdentification | None
    no_timing: str | None = None
    log_warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        told = sum(joint.identified for joint in self.joints)
        return f"FrictionIdentification({self.robot.name!r} from {self.source!r}: {told} of {len(self.joints)} joints)"

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know before the figures are used, a sentence each."""
        found = ["no power was measured: copper loss, base power and efficiencies stay those of the file"]
        found += self.log_warnings
        off = [
            f"{joint.joint} ({joint.torque_scale:.2f})"
            for joint in self.joints
            if abs(joint.torque_scale - 1.0) > max(POOR_SCALE, 3.0 * joint.torque_scale_error)
        ]
        if off:
            found.append(
                f"measured torques differ from those of the file's inertia by the factors given: {', '.join(off)}; "
                "check payload and torque constants"
            )
        return (*found, *timing_warnings(self.timing, self.no_timing))

    def to_dict(self) -> dict[str, Any]:
        """Figures as plain data, ready for JSON."""
        return {
            "robot": self.robot.name,
            "payload_kg": float(self.robot.payload.mass_kg),
            "log": self.source,
            "joints": [asdict(joint) for joint in self.joints],
            "unidentified": [joint.joint for joint in self.joints if not joint.identified],
            "timing": None if self.timing is None else self.timing.to_dict(),
            "warnings": list(self.warnings),
        }

    def robot_file(self, name: str | None = None) -> RobotFile:
        """The robot file with the identified friction, and timing if it is good.

        Args:
            name: Name of the new entry (default: the robot's name with `_identified`).
        """
        data = with_timing(self.robot.file, self.timing, name).model_dump(mode="json")
        drives = data["drives"]
        told = [joint for joint in self.joints if joint.identified]
        for joint in told:
            for key in ("coulomb_nm", "viscous_nm_s_per_rad"):
                drives["joints"][joint.joint][key] = float(f"{getattr(joint, key):.{_SIGNIFICANT_DIGITS}g}")
        names = ", ".join(joint.joint for joint in told) or "none"
        drives["provenance"] = (
            f"friction of {names} identified from torques of the log {Path(self.source).name}; copper loss, base power "
            f"and efficiencies as before. Before: {self.robot.file.drives.provenance}"
        )
        note = f"friction from the log {Path(self.source).name}; see drives.provenance"
        data["provenance"]["drives"] = {"kind": "identified", "note": note}
        return parse(RobotFile, data, f"identified {self.robot.name}")


def identify_friction(log: MeasuredLog, robot: Robot, smoothing_s: float | None = None) -> FrictionIdentification:
    """Friction and torque scale of each joint, and the controller's timing.

    Args:
        log: Checked log with torques.
        robot: The robot with its payload; its link inertias, gear ratios and rotors are taken as given.
        smoothing_s: See `robojoule.calibration.signals.prepare`. [s]

    Raises:
        InputError: The log holds no torques, or is too short.
    """
    if log.torque_nm is None:
        allowed = "power_w, or q1_torque_nm .., or q1_current_a .. with torque constants"
        raise InputError("the log holds neither power nor torques", file=log.source, key="power_w", allowed=allowed)
    signals = prepare(log, robot, smoothing_s)
    joints = tuple(_joint(signals, robot, place) for place in range(robot.joint_count))
    return FrictionIdentification(robot, log.source, joints, *log_timing(log, robot), log.clock_warnings)


def _joint(signals: Signals, robot: Robot, place: int) -> JointFriction:
    name, drives = robot.joint_names[place], robot.drives
    known = float(drives.coulomb_nm[place]), float(drives.viscous_nm_s_per_rad[place])
    assert signals.torque_nm is not None
    columns = (signals.load_nm, signals.direction, signals.velocity_rad_s, signals.torque_nm)
    load, direction, velocity, torque = (signals.average(column[:, place]) for column in columns)
    slides = np.abs(direction) > SLIDES
    basis = np.stack([load, direction, velocity, np.ones_like(load)], axis=1)
    train, held = slides & ~signals.held_out, slides & signals.held_out
    none = JointFriction(name, known[0], None, known[1], None, 1.0, 1.0, 0.0, identified=False)
    if train.sum() < FEWEST_WINDOWS or np.unique(np.sign(direction[train])).size < 2:
        return none
    found, error = robust_fit(basis[train], torque[train], signals.window_block[train])
    error = wider_for_few(np.unique(signals.window_block[train]).size) * error
    judged = held if held.sum() >= FEWEST_WINDOWS // 4 else train
    left = torque[judged] - basis[judged] @ found
    r2 = 1.0 - float(left @ left) / max(float(((torque[judged] - torque[judged].mean()) ** 2).sum()), 1e-12)
    coulomb, viscous = float(found[1]), float(found[2])
    told = coulomb > 0.0 and viscous >= 0.0 and bool(error[1] < WELL_KNOWN * coulomb)
    # Friction that hardly grows with speed is told where its growth is small beside Coulomb's, too.
    fastest = float(np.abs(velocity[train]).max())
    told = told and bool(error[2] < WELL_KNOWN * max(viscous, coulomb / fastest))
    return JointFriction(
        joint=name,
        coulomb_nm=coulomb if told else known[0],
        coulomb_error_nm=float(error[1]) if told else None,
        viscous_nm_s_per_rad=viscous if told else known[1],
        viscous_error_nm_s_per_rad=float(error[2]) if told else None,
        torque_scale=float(found[0]),
        torque_scale_error=float(error[0]),
        r2=max(r2, 0.0),
        identified=told,
    )


def robust_fit(basis: Array, values: Array, block: Index) -> tuple[Array, Array]:
    """Robust least squares with standard errors that know that windows of one motion hang together.

    They are those by the sums of each motion (MacKinnon and White's correction for few of them), or those of
    independent windows where they are larger: sums of few motions say little of their spread, that of one is zero.

    Args:
        basis: What the values are linear in, shape (W, P).
        values: Shape (W,).
        block: Motion of each window, shape (W,).

    Returns:
        Coefficients and their standard errors, each of shape (P,).
    """
    scale = np.maximum(np.abs(basis).max(axis=0), 1e-12)
    scaled, weight = basis / scale, np.ones(len(values))
    ridge = 1e-9 * len(values) * np.eye(basis.shape[1])
    found = np.zeros(basis.shape[1])
    for _ in range(_ITERATIONS):
        before = found
        found = np.linalg.solve(scaled.T @ (scaled * weight[:, None]) + ridge, scaled.T @ (weight * values))
        left = values - scaled @ found
        spread = max(MAD_TO_SIGMA * float(np.median(np.abs(left))), 1e-12)
        weight = np.minimum(1.0, HUBER * spread / np.maximum(np.abs(left), 1e-12))
        if np.abs(found - before).max() < 1e-9 * max(float(np.abs(found).max()), 1e-12):
            break
    inverse = np.linalg.inv(scaled.T @ (scaled * weight[:, None]) + ridge)
    _, motion = np.unique(block, return_inverse=True)
    sums = np.zeros((int(motion.max()) + 1, basis.shape[1]))
    np.add.at(sums, motion, scaled * (weight * left)[:, None])
    motions = len(sums)
    hanging = np.diag(inverse @ (sums.T @ sums) @ inverse) * motions / max(motions - 1, 1)
    freedom = max(len(values) - basis.shape[1], 1)
    alone = float(weight @ left**2) / freedom * np.diag(inverse)
    return found / scale, np.sqrt(np.maximum(np.maximum(hanging, alone), 0.0)) / scale
