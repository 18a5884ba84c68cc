"""The energy profile of one motion from runs at equidistant speed limits, with where the energy goes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, frozen
from robojoule.errors import InputError
from robojoule.inputs import shown
from robojoule.motion.motions import Motions
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.sampled import SampledProfile, sampled_profile
from robojoule.robots.robot import Robot

# Parts of the mains energy, in the order in which they are shown: what stays whatever the speed is first.
PARTS = ("base_j", "drive_active_j", "inverter_j", "copper_j", "friction_j", "braking_j", "potential_j")
SLOWEST_SPEED_LIMIT = 0.1
MOST_POINTS = 1000
LEAST_TRAVEL_RAD = 1e-9  # below: what rounding of degrees leaves of no motion


@dataclass(frozen=True, eq=False)
class EnergyProfile:
    """Energy of one motion over its duration: S distinct runs, the slowest first.

    Predicted and measured profiles have an interval, and do not say where the energy goes.

    Attributes:
        robot: Name of the robot.
        payload_kg: What it carries. [kg]
        speed_limits: Lowest speed limit that gives each run, shape (S,), fractions in (0, 1].
        durations_s: Shape (S,), falling. [s]
        energies_j: Shape (S,). [J]
        parts_j: Parts of the energies by name (see `PARTS`), each of shape (S,); they add up to the energies. None but
            for simulated profiles. [J]
        peak_torque_ratio: Largest joint torque over its peak limit in all runs. [-]
        rms_torque_ratio: Largest root mean square of a joint torque over a run, over its continuous limit. [-]
        idle_power_start_w: Power of the robot that stands at the start. [W]
        idle_power_end_w: Power of the robot that stands at the end. [W]
        doubts: What is implausible about the robot, a sentence each.
        profiles: Where durations and energies come from: simulated, predicted or measured.
        low_j: Lower end of the interval that holds an energy with 90 %, shape (S,); None for simulated profiles. [J]
        high_j: Its upper end. [J]
        low_s: Lower end of the interval that holds a duration with 90 %, shape (S,); of measured profiles alone. [s]
        high_s: Its upper end. [s]
        measured_speed_limits: Those at which the motion was measured, rising. [-]
        rule: The controller's rule that the runs show, if there are any.
    """

    robot: str
    payload_kg: float
    speed_limits: Array
    durations_s: Array
    energies_j: Array
    parts_j: Mapping[str, Array]
    peak_torque_ratio: float
    rms_torque_ratio: float
    idle_power_start_w: float
    idle_power_end_w: float
    doubts: tuple[str, ...] = ()
    profiles: str = "simulated"
    low_j: Array | None = None
    high_j: Array | None = None
    low_s: Array | None = None
    high_s: Array | None = None
    measured_speed_limits: Array = field(default_factory=lambda: frozen(np.zeros(0)))
    rule: str | None = None

    def __repr__(self) -> str:
        return (
            f"EnergyProfile({self.robot!r}: runs={self.durations_s.size}, "
            f"durations {self.durations_s[-1]:.4g} to {self.durations_s[0]:.4g} s, "
            f"optimal_duration_s={self.optimal_duration_s:.4g}, energy_saving_j={self.energy_saving_j:.4g})"
        )

    @property
    def sampled(self) -> SampledProfile:
        """The runs by rising duration, as planning takes them."""
        return SampledProfile(self.durations_s[::-1], self.energies_j[::-1], self.speed_limits[::-1])

    @property
    def optimal_speed_limit_percent(self) -> float:
        """Speed limit of the run with the least energy. [%]"""
        return 100.0 * float(self.sampled.speed_limits[self.sampled.optimum])

    @property
    def optimal_duration_s(self) -> float:
        """Duration of the run with the least energy. [s]"""
        return float(self.sampled.durations_s[self.sampled.optimum])

    @property
    def energy_saving_j(self) -> float:
        """Energy of the fastest run less that of the best one. [J]"""
        return self.sampled.saving_j

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know about the motion, a sentence each."""
        peak = (torque_warning(self.peak_torque_ratio),) if self.peak_torque_ratio > 1.0 else ()
        rms = (rms_torque_warning(self.rms_torque_ratio),) if self.rms_torque_ratio > 1.0 else ()
        return self.doubts + peak + rms

    def to_dict(self) -> dict[str, Any]:
        """The profile as plain data, ready for JSON."""
        return {
            "robot": self.robot,
            "payload_kg": self.payload_kg,
            "speed_limit_percent": (100.0 * self.speed_limits).round(6).tolist(),
            "duration_s": self.durations_s.tolist(),
            "energy_j": self.energies_j.tolist(),
            "parts_j": {part: values.tolist() for part, values in self.parts_j.items()},
            "optimal_speed_limit_percent": round(self.optimal_speed_limit_percent, 6),
            "optimal_duration_s": self.optimal_duration_s,
            "energy_saving_j": self.energy_saving_j,
            "peak_torque_ratio": self.peak_torque_ratio,
            "rms_torque_ratio": self.rms_torque_ratio,
            "idle_power_start_w": self.idle_power_start_w,
            "idle_power_end_w": self.idle_power_end_w,
            "profiles": self.profiles,
            "energy_low_j": None if self.low_j is None else self.low_j.tolist(),
            "energy_high_j": None if self.high_j is None else self.high_j.tolist(),
            "duration_low_s": None if self.low_s is None else self.low_s.tolist(),
            "duration_high_s": None if self.high_s is None else self.high_s.tolist(),
            "measured_speed_limit_percent": (100.0 * self.measured_speed_limits).round(6).tolist(),
            "rule": self.rule,
            "warnings": list(self.warnings),
        }


def simulated_profile(robot: Robot, start_rad: ArrayLike, end_rad: ArrayLike, points: int) -> EnergyProfile:
    """Simulate a motion at equidistant speed limits from 10 to 100 %.

    Args:
        robot: Robot with its payload.
        start_rad: Start configuration, shape (n,). [rad]
        end_rad: End configuration, shape (n,). [rad]
        points: Number of speed limits; those that give the same run count once.

    Raises:
        InputError: Not as many points as allowed, or no motion.
    """
    check_points(points)
    if np.allclose(start_rad, end_rad, rtol=0.0, atol=LEAST_TRAVEL_RAD):
        raise InputError("start and end are the same: there is no motion")
    return profile_of(robot, MotionPaths(robot, start_rad, end_rad), points)


def check_points(points: object) -> None:
    """Refuse a number of speed limits that a profile cannot have.

    Raises:
        InputError: It is not a whole number, or out of range.
    """
    if not isinstance(points, Integral) or not 2 <= int(points) <= MOST_POINTS:
        allowed = f"a whole number from 2 to {MOST_POINTS}"
        raise InputError(f"{shown(points)} is not a valid number of points", key="points", allowed=allowed)


def profile_of(robot: Robot, paths: Motions, points: int) -> EnergyProfile:
    """The same of a single motion of any kind.

    Args:
        robot: Robot with its payload.
        paths: The motion.
        points: See `simulated_profile`.
    """
    runs = paths.simulate(np.linspace(SLOWEST_SPEED_LIMIT, 1.0, points))
    limits = runs.speed_limit[0]
    rms_nm = np.sqrt(runs.torque_square_integral_nm2_s[0] / runs.duration_s[0, :, np.newaxis])
    distinct = sampled_profile(runs.duration_s[0], runs.energy_j[0], limits)
    rows = np.searchsorted(limits, distinct.speed_limits[::-1])
    return EnergyProfile(
        robot=robot.name,
        payload_kg=float(robot.payload.mass_kg),
        speed_limits=frozen(limits[rows]),
        durations_s=frozen(runs.duration_s[0, rows]),
        energies_j=frozen(runs.energy_j[0, rows]),
        parts_j={part: frozen(getattr(runs, part)[0, rows]) for part in PARTS},
        peak_torque_ratio=float(runs.peak_torque_ratio.max()),
        rms_torque_ratio=float((rms_nm / robot.effort_nm).max()),
        idle_power_start_w=float(paths.idle_power_start_w[0]),
        idle_power_end_w=float(paths.idle_power_end_w[0]),
        doubts=tuple(map(str, robot.doubts)),
    )


def torque_warning(ratio: float, where: str = "") -> str:
    """What to say of a joint torque beyond its peak limit, as a ratio of both."""
    return f"a joint torque reaches {100.0 * ratio:.1f} % of its peak limit{where}: lighten the payload or fold the arm"


def rms_torque_warning(ratio: float) -> str:
    """What to say of a root mean square of a joint torque beyond its continuous limit, as a ratio of both."""
    return (
        f"a joint torque has a root mean square of {100.0 * ratio:.1f} % of its continuous limit: the drive would "
        "overheat in the long run; lighten the payload, fold the arm or take more time"
    )
