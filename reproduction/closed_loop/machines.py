"""Hidden machines: controllers and plants that differ from the catalog entry that planners know."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from reproduction.study.config import MachineRanges, Range
from robojoule.arrays import Array
from robojoule.motion.learnt_controller import LearntPathTiming
from robojoule.motion.simulation import MotionPaths
from robojoule.robots.controller_file import ControllerTiming
from robojoule.robots.robot import Payload, Robot

PERCENT = np.arange(10, 101) / 100.0
"""Speed limits of every table of this study: whole percents from 10 to 100. [-]"""


@dataclass(frozen=True, eq=False)
class HiddenMachine:
    """A machine: what its motions take and cost.

    Attributes:
        name: What tables call it.
        inside: Whether its structure is among the rules that planners fit.
        controller: Its timing.
        plant: Its arm and drives.
        step_s: Step to which durations are rounded up; 0: none. [s]
        dead_s: What every motion takes beyond its law and this rounding. [s]
        other_direction: Acceleration limits of joints that move downwards, over the others'; None: the same. [-]
        filter_growth: Filter time at full speed over that at none. [-]
        whole_percents: Whether decimals of a speed limit are cut off.
        jitter_s: Standard deviation by which a motion's duration differs from cycle to cycle. [s]
    """

    name: str
    inside: bool
    controller: ControllerTiming
    plant: Robot
    step_s: float = 0.0
    dead_s: float = 0.0
    other_direction: Array | None = None
    filter_growth: float = 1.0
    whole_percents: bool = False
    jitter_s: float = 0.0

    def table(self, nominal: Robot, start_rad: Array, end_rad: Array) -> MachineTable:
        """What motions of this machine take and cost at every whole percent.

        Args:
            nominal: The controller's model of the robot.
            start_rad: Shape (M, n). [rad]
            end_rad: Shape (M, n). [rad]
        """
        paths = MotionPaths(self.plant, start_rad, end_rad, nominal)
        if self.filter_growth == 1.0:
            runs = self._by(paths, self.controller).simulate(PERCENT)
            durations, energies = runs.duration_s, runs.energy_j
        else:
            columns = []
            for limit in PERCENT.tolist():
                longer = self.controller.filter_time_s * (1.0 + (self.filter_growth - 1.0) * limit)
                by = self._by(paths, replace(self.controller, filter_time_s=longer))
                found = by.simulate(np.array([limit]))
                columns.append((found.duration_s[:, 0], found.energy_j[:, 0]))
            durations, energies = (np.stack(column, axis=1) for column in zip(*columns, strict=True))
        idle = np.stack([paths.idle_power_start_w, paths.idle_power_end_w], axis=1)
        longer_s = np.ceil(durations / self.step_s - 1e-9) * self.step_s if self.step_s else durations.copy()
        longer_s += self.dead_s
        energies = energies + (longer_s - durations) * idle[:, 1:]
        return MachineTable(longer_s, energies, idle, self.jitter_s, self.whole_percents)

    def _by(self, paths: MotionPaths, controller: ControllerTiming) -> MotionPaths:
        found = copy.copy(paths)
        timing = paths.timing
        found.timing = DirectedTiming(
            timing.robot, timing.torques, paths.path, controller, other_direction=self.other_direction
        )
        found.timing.take_full_speed(timing, slice(None))
        return found


class DirectedTiming(LearntPathTiming):
    """A timing whose acceleration limits depend on the direction in which joints move."""

    def __init__(self, *known: object, other_direction: Array | None) -> None:
        super().__init__(*known)  # type: ignore[arg-type]
        self.other_direction = other_direction

    @cached_property
    def _first(self) -> Array:
        limits = self.controller.acceleration_rad_s2
        if limits is None or self.other_direction is None:
            return LearntPathTiming._first.func(self)  # type: ignore[attr-defined,no-any-return]
        down = self.path.delta_rad < 0.0
        directed = np.where(down, limits * self.other_direction, limits)
        with np.errstate(divide="ignore"):
            return np.asarray(np.where(self.moving, np.min(directed / self.path.steepest_rad, axis=1), 1.0))


@dataclass(frozen=True, eq=False)
class MachineTable:
    """What M motions of a machine take and cost at the whole percents of `PERCENT`.

    Attributes:
        duration_s: Shape (M, S). [s]
        energy_j: Shape (M, S). [J]
        idle_w: Idle power at start and end, shape (M, 2). [W]
        jitter_s: Standard deviation by which a duration differs from cycle to cycle. [s]
        whole_percents: Whether decimals of a speed limit are cut off.
    """

    duration_s: Array
    energy_j: Array
    idle_w: Array
    jitter_s: float
    whole_percents: bool

    @property
    def fastest_s(self) -> float:
        """Least cycle time. [s]"""
        return float(self.duration_s.min(axis=1).sum())


def hidden_machines(nominal: Robot, ranges: MachineRanges, seed: int) -> Iterator[HiddenMachine]:
    """Draw the eight machines: four inside the rules that planners fit, four outside.

    Args:
        nominal: What planners know, with its payload.
        ranges: What figures are drawn from.
        seed: Seed of all draws.
    """
    rng = np.random.default_rng([seed, 1])
    drives, joints = nominal.drives, nominal.joint_count
    speeds, share = nominal.velocity_rad_s, drives.least_cruise_share

    def drawn(of: Range) -> float:
        return float(rng.uniform(*of))

    def accelerations() -> Array:
        ramps = np.linspace(ranges.ramp_s[1], ranges.ramp_s[0], joints) * rng.uniform(0.9, 1.1, joints)
        return np.asarray(speeds / ramps)

    def plant() -> Robot:
        payload = Payload(min(nominal.payload.mass_kg * drawn(ranges.payload), nominal.file.rated_payload_kg))
        carried = Robot(nominal.file, replace(payload, com_m=nominal.payload.com_m))
        return carried.variant(
            drives=replace(
                carried.drives,
                coulomb_nm=drives.coulomb_nm * rng.uniform(*ranges.friction, joints),
                viscous_nm_s_per_rad=drives.viscous_nm_s_per_rad * rng.uniform(*ranges.friction, joints),
                load_friction=rng.uniform(*ranges.load_friction, joints),
            )
        )

    def by_torque(filter_s: float, velocity: float = 1.0, factor: float = 1.0, power: float = 0.0) -> ControllerTiming:
        return ControllerTiming(
            rule="torque_limited",
            velocity_rad_s=speeds * velocity,
            acceleration_rad_s2=None,
            acceleration_factor=factor,
            acceleration_exponent=power,
            filter_time_s=filter_s,
            least_cruise_share=share,
        )

    def by_joint(power: float = 0.0) -> ControllerTiming:
        return ControllerTiming(
            rule="joint_accelerations",
            velocity_rad_s=speeds,
            acceleration_rad_s2=accelerations(),
            acceleration_exponent=power,
            filter_time_s=drawn(ranges.filter_s),
        )

    slower = drawn(ranges.slower)
    filter_s = drives.filter_time_s
    yield HiddenMachine("joint accelerations", True, by_joint(), nominal)
    yield HiddenMachine("slower", True, by_torque(filter_s, slower, slower), nominal)
    yield HiddenMachine("other filter", True, by_torque(filter_s * drawn(ranges.filter_factor)), nominal)
    scaled = by_torque(filter_s, power=drawn(ranges.scaled_exponent))
    yield HiddenMachine("scaled acceleration, other plant", True, scaled, plant())
    yield HiddenMachine("odd", False, by_joint(0.5), nominal, step_s=ranges.odd_step_s, dead_s=ranges.odd_dead_s)
    yield HiddenMachine(
        "asymmetric, other plant",
        False,
        by_joint(),
        plant(),
        dead_s=drawn(ranges.dead_s),
        other_direction=rng.uniform(*ranges.direction, joints),
        filter_growth=drawn(ranges.filter_growth),
    )
    rounding = by_torque(filter_s, drawn(ranges.slower), drawn(ranges.slower))
    yield HiddenMachine("rounds decimals down", False, rounding, nominal, whole_percents=True)
    yield HiddenMachine("jitter", False, by_joint(), nominal, jitter_s=ranges.jitter_s)
