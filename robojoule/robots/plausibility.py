"""What is implausible about a robot: figures that are possible, but that no real arm has.

Bounds are wide: those over the catalog with a margin of two or so. What lies beyond is a wrong unit, a placeholder or a
slip far more often than an odd machine. A doubt says what was found and names the key that mends it.

Sums of masses follow M = 14 kg (payload / kg)^0.5 (reach / m)^1.5 within a factor of 3 on the 25 arms of the catalog,
from collaborative to 500 kg; the idle power grows as the scaling laws say (`robojoule.robots.scaling`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.robots.body_checks import NO_MASS_KG, inertia_matrix
from robojoule.robots.drives import idle_power_w
from robojoule.robots.recursion import path_points
from robojoule.robots.robot_file import of_joint

if TYPE_CHECKING:
    from robojoule.robots.robot import Robot

MASS_OF_KG_AND_M = 14.0  # of the moving links, for a rated payload of 1 kg and a reach of 1 m
MASS_FACTORS = (0.15, 3.0)  # the catalog: 0.34 to 1.72
WRONG_UNIT = 100.0  # factor from which on a mass is refused: grams
GRAVITY_OVER_PEAK = 1.5  # at rated payload in the worst pose; the catalog: up to 1.22
OWN_GRAVITY_OVER_PEAK = 1.0  # with nothing carried; the catalog: up to 0.56
NEEDED_SHARE = 0.05  # least share of its peak that any joint needs against gravity; the catalog: 0.55 or more
FASTEST_RAD_S = 30.0  # 1700 degrees/s; the fastest joint of the catalog turns at 18 rad/s
FARTHEST_RAD = 30.0  # five turns
LONGEST_M = 20.0
SHORTEST_M = 0.2  # what counts as reach at least: that of a trunk whose axes meet in a point says nothing of its size
WIDEST = 1.0  # radius of gyration of a link over the reach; the catalog: up to 0.25
DENSEST_KG_M3 = 19_300.0  # tungsten
LARGEST_IDLE = 10.0  # idle power in the worst pose over that of the scaling laws; the catalog: up to 5.2
FRICTION_SHARE = 0.9  # of the effort limit at full speed; the catalog: up to 0.51
_CONFIGURATIONS = 100
_IDLE_W, _INSTALLED_W, _IDLE_EXPONENT = 430.0, 19_600.0, 0.41


@dataclass(frozen=True)
class Doubt:
    """Something implausible about a robot.

    Attributes:
        problem: What it is, in one sentence.
        key: The key of the robot file or drive file that mends it.
    """

    problem: str
    key: str

    def __str__(self) -> str:
        return f"{self.problem} (see {self.key})"


def doubts_about(robot: Robot) -> tuple[Doubt, ...]:
    """Everything implausible about a robot.

    Raises:
        InputError: The masses are in a wrong unit.
    """
    own_nm, loaded_nm = (_gravity_nm(robot, mass_kg) for mass_kg in (0.0, robot.file.rated_payload_kg))
    found = [doubt for check in (_branches, _masses, _inertia, _kinematics, _limits) for doubt in check(robot)]
    return (*found, *_torques(robot, own_nm, loaded_nm), *_drives(robot, loaded_nm))


def _branches(robot: Robot) -> Iterator[Doubt]:
    for joint, position in robot.file.lumped_branches.items():
        yield Doubt(f"the joint '{joint}' is not between base and tool: it is held at {position:g}", f"freeze.{joint}")


def _masses(robot: Robot) -> Iterator[Doubt]:
    file = robot.file
    masses = {name: link.mass_kg for name, link in file.links.items() if link is not None and _moves(robot, name)}
    if not masses or file.rated_payload_kg <= 0.0:
        return
    mass, heaviest = sum(masses.values()), max(masses, key=lambda name: masses[name])
    usual = MASS_OF_KG_AND_M * file.rated_payload_kg**0.5 * max(file.reach_m, SHORTEST_M) ** 1.5
    problem = (
        f"the moving links weigh {_said(mass)} kg together, {_said(mass / usual)} times what arms of "
        f"{file.rated_payload_kg:g} kg rated payload and {file.reach_m:.2f} m reach do ({_said(usual)} kg)"
    )
    if mass > WRONG_UNIT * usual:
        raise InputError(problem, file=robot.source, key=f"links.{heaviest}.mass_kg", allowed="masses in kg, not in g")
    if not MASS_FACTORS[0] <= mass / usual <= MASS_FACTORS[1]:
        yield Doubt(problem, f"links.{heaviest}.mass_kg, rated_payload_kg")


def _inertia(robot: Robot) -> Iterator[Doubt]:
    reach_m = max(robot.file.reach_m, SHORTEST_M)
    for name, link in robot.file.links.items():
        if link is None or link.mass_kg <= NO_MASS_KG or not _moves(robot, name) or name in robot.file.lumped_links:
            continue
        largest = float(np.linalg.eigvalsh(inertia_matrix(link.inertia_kg_m2))[-1])
        radius = math.sqrt(max(largest, 0.0) / link.mass_kg)
        # of a ball, the smallest body of its mass and density
        least = math.sqrt(0.4) * (3.0 * link.mass_kg / (4.0 * math.pi * DENSEST_KG_M3)) ** (1.0 / 3.0)
        key = f"links.{name}.inertia_kg_m2"
        if radius > WIDEST * reach_m:
            problem = f"the radius of gyration of link '{name}' is {radius:.3g} m, the reach {reach_m:.2f} m"
            yield Doubt(f"{problem}: is its inertia in g m2 or kg mm2?", key)
        elif 0.0 < radius < least and link.mass_kg >= 0.1:
            yield Doubt(
                f"link '{name}' would be denser than tungsten: {link.mass_kg:g} kg with {largest:.3g} kg m2", key
            )
        if np.linalg.norm(link.com_m) > 3.0 * reach_m:
            problem = f"the centre of mass of link '{name}' is {np.linalg.norm(link.com_m):.3g} m from its joint"
            yield Doubt(f"{problem}: is it in mm?", f"links.{name}.com_m")


def _kinematics(robot: Robot) -> Iterator[Doubt]:
    if robot.file.reach_m > LONGEST_M:
        farthest = max(robot.file.joints, key=lambda joint: float(np.linalg.norm(joint.origin_xyz_m)))
        problem = f"the reach is {robot.file.reach_m:.4g} m: are the origins of the joints in mm?"
        yield Doubt(problem, f"{of_joint(farthest.name)}: origin_xyz_m")


def _limits(robot: Robot) -> Iterator[Doubt]:
    for joint, lower, upper, speed in zip(
        robot.joint_names, robot.lower_rad, robot.upper_rad, robot.velocity_rad_s, strict=True
    ):
        if max(abs(lower), abs(upper)) > FARTHEST_RAD:
            problem = f"{joint} turns from {lower:g} to {upper:g} rad: are these degrees?"
            yield Doubt(problem, f"limits.{joint}.lower_rad, upper_rad")
        if speed > FASTEST_RAD_S:
            yield Doubt(f"{joint} turns at {speed:g} rad/s: are these degrees/s?", f"limits.{joint}.velocity_rad_s")
    efforts = robot.effort_nm
    if robot.joint_count >= 3 and np.all(efforts == efforts[0]):
        problem = f"all joints have the same effort limit, {efforts[0]:g} Nm, as placeholders have"
        yield Doubt(problem, f"limits.{robot.joint_names[0]}.effort_nm and those of the other joints")


def _torques(robot: Robot, own_nm: Array, loaded_nm: Array) -> Iterator[Doubt]:
    own, loaded = (np.abs(torques).max(axis=0) for torques in (own_nm, loaded_nm))
    peaks = robot.peak_effort_nm
    for torques, bound, carrying in (
        (own, OWN_GRAVITY_OVER_PEAK, "with nothing carried"),
        (loaded, GRAVITY_OVER_PEAK, f"with {robot.file.rated_payload_kg:g} kg"),
    ):
        ratios = torques / peaks
        worst = int(np.argmax(ratios))
        if ratios[worst] > bound:
            joint = robot.joint_names[worst]
            problem = (
                f"gravity needs up to {torques[worst]:.3g} Nm of {joint} {carrying}, its limit is {peaks[worst]:g} Nm"
            )
            yield Doubt(problem, f"limits.{joint}.effort_nm, links")
            return
    if 0.0 < (share := float((loaded / peaks).max())) < NEEDED_SHARE:
        problem = f"no joint needs more than {100.0 * share:.2g} % of its effort limit against gravity at rated payload"
        yield Doubt(f"{problem}, so the limits seem to be placeholders", "limits, links")


def _drives(robot: Robot, gravity: Array) -> Iterator[Doubt]:
    drives, file = robot.drives, robot.file
    friction = drives.coulomb_nm + drives.viscous_nm_s_per_rad * robot.velocity_rad_s
    for joint, share in zip(robot.joint_names, friction / robot.peak_effort_nm, strict=True):
        if share > FRICTION_SHARE:
            problem = f"friction takes {100.0 * share:.0f} % of the effort limit of {joint} at full speed"
            yield Doubt(problem, f"drives.joints.{joint}.coulomb_nm, viscous_nm_s_per_rad")
    idle_w = idle_power_w(drives, gravity)
    usual_w = _IDLE_W * (file.installed_power_w / _INSTALLED_W) ** _IDLE_EXPONENT
    worst = int(np.argmax(idle_w))
    if idle_w[worst] > LARGEST_IDLE * usual_w:
        copper_w = gravity[worst] ** 2 * drives.copper_w_per_joint_nm2
        joint = robot.joint_names[int(np.argmax(copper_w))]
        key = f"drives.joints.{joint}.copper_w_per_nm2, gear_ratio"
        if drives.base_power_w > copper_w.sum():
            key = "drives.base_power_w"
        problem = f"standing still takes up to {_watts(idle_w[worst])} at rated payload, where such arms take some"
        yield Doubt(f"{problem} {_watts(usual_w)}", key)


def _said(figure: float) -> str:
    return f"{float(f'{figure:.2g}'):g}"


def _watts(power_w: float) -> str:
    return f"{power_w:.0f} W" if power_w < 1e4 else f"{power_w / 1e3:.0f} kW"


def _gravity_nm(robot: Robot, mass_kg: float) -> Array:
    """Gravity torques over random configurations within the limits, one turn at most, shape (N, n). [Nm]"""
    from robojoule.robots.robot import Payload, Robot  # late: robots tell their doubts

    loaded = Robot(robot.file, Payload(mass_kg), robot.source)
    lower, upper = np.maximum(loaded.lower_rad, -np.pi), np.minimum(loaded.upper_rad, np.pi)
    q = np.random.default_rng(0).uniform(np.minimum(lower, upper), upper, (_CONFIGURATIONS, loaded.joint_count))
    return np.asarray(path_points(loaded.mechanism, q.T, np.zeros_like(q.T))[2].T)


def _moves(robot: Robot, link: str) -> bool:
    number, _ = robot.mechanism.anchors.get(link, (0, None))
    return number > 0
