"""Scaling laws: the drives of arms whose drives nobody has published.

Geometrically similar machines share some figures, whatever their size. Per joint, with the effort limit T, the speed
limit v and the gear ratio i (`JointNumbers`):

    motor speed at full joint speed   i v                    servo motors of one range turn equally fast
    Coulomb share                     coulomb / T
    viscous share                     viscous v / T
    spin-up time                      i^2 J v / T            the rotor alone, at the effort limit
    copper loss per motor torque      k T / i   [W/Nm]       equal current density: loss and torque grow with volume

Industrial arms: each number is interpolated in log T between the fitted reference robot and the identified KR300 and
held constant beyond them, joint by joint. Copper loss is the same share of the drive power at the effort limit for all:
the one that the reference robot's fit starts from, not the fitted one, which exceeds that of servo drives elsewhere.
Collaborative arms have harmonic drives: the UR10e's identified friction shares, an assumed gear ratio, the rest from
the reference robot.

Of the whole arm, with the installed power P = sum T v and the reach L:

    base power                        P^p                    p from two published idle powers, see anchors.yaml
    drive-active power                as base power
                                      (both of industrial arms; those of collaborative arms do not grow)
    filter time                       L                      eigenfrequencies of similar arms fall with their length

Effort limits that are only placeholders (FANUC) follow from static and dynamic need (`EffortRule`), with constants that
are medians over the arms with published effort limits: industrial arms for industrial arms, collaborative ones for
collaborative ones.

`python -m robojoule.robots.scaling` rebuilds the entries of the catalog whose drives are marked as scaled.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from robojoule.arrays import Array
from robojoule.documents import parse, read_document, write_document
from robojoule.robots import catalog_path, list_robots, load_robot_file
from robojoule.robots.anchors import AnchorFile, CobotAnchors, Kr300, load_anchors, load_kr300
from robojoule.robots.collision import derive_capsules
from robojoule.robots.effort import SIX_ROLES, EffortRule, limits
from robojoule.robots.robot_file import RobotFile

DIGITS = 4  # significant digits of scaled figures: more would pretend to be known
LEAST_FILTER_TIME_S = 1e-3  # of an arm of no reach, such as a tool that only turns
# Viscous friction of grease-lubricated gears rises with about the square root of speed beyond the speeds at which it
# was identified (shear thinning); a line through the identified range would exceed the effort limit at full speed.
VISCOUS_EXPONENT = 0.5


@dataclass(frozen=True)
class JointNumbers:
    """Figures of the drives that similar machines share, each of shape (n,).

    Attributes:
        motor_speed_rad_s: Motor speed at the joint's speed limit. [rad/s]
        coulomb_share: Coulomb friction over effort limit. [-]
        viscous_share: Viscous friction at the speed limit over effort limit. [-]
        spin_up_s: Time in which the effort limit brings the rotor alone to full speed. [s]
        copper_w_per_nm: Copper loss at the effort limit per motor torque. [W/Nm]
    """

    motor_speed_rad_s: Array
    coulomb_share: Array
    viscous_share: Array
    spin_up_s: Array
    copper_w_per_nm: Array

    @classmethod
    def of(cls, effort: Array, velocity: Array, drives: dict[str, Array]) -> JointNumbers:
        """Numbers of known drives; keys of `drives` as in `robojoule.robots.drives.DriveParameters`."""
        gear = drives["gear_ratio"]
        return cls(
            motor_speed_rad_s=gear * velocity,
            coulomb_share=drives["coulomb_nm"] / effort,
            viscous_share=drives["viscous_nm_s_per_rad"] * velocity / effort,
            spin_up_s=gear**2 * drives["rotor_inertia_kg_m2"] * velocity / effort,
            copper_w_per_nm=drives["copper_w_per_nm2"] * effort / gear,
        )

    def drives(self, effort: Array, velocity: Array) -> dict[str, Array]:
        """Drives of an arm with these numbers: the inverse of `of`."""
        gear = self.motor_speed_rad_s / velocity
        return {
            "gear_ratio": gear,
            "rotor_inertia_kg_m2": self.spin_up_s * effort / velocity / gear**2,
            "coulomb_nm": self.coulomb_share * effort,
            "viscous_nm_s_per_rad": self.viscous_share * effort / velocity,
            "copper_w_per_nm2": self.copper_w_per_nm * gear / effort,
        }


@dataclass(frozen=True)
class Scaling:
    """The laws with their anchors.

    Attributes:
        anchors: Published anchors.
        kr300: Identified figures of the KR300.
        files: Catalog entries by name; those that the laws scale are read for everything but drives.
    """

    anchors: AnchorFile
    kr300: Kr300
    files: dict[str, RobotFile]

    @cached_property
    def reference(self) -> RobotFile:
        """The fitted reference robot."""
        return self.files[self.anchors.fitted]

    @cached_property
    def reference_numbers(self) -> JointNumbers:
        """Numbers of the fitted reference robot, with the copper loss that is handed on."""
        joints = self.reference.drives.joints
        names = [joint.name for joint in self.reference.moving_joints]
        keys = type(joints[names[0]]).model_fields
        drives = {key: np.array([getattr(joints[name], key) for name in names]) for key in keys}
        numbers = JointNumbers.of(*limits(self.reference), drives)
        return replace(numbers, copper_w_per_nm=self.anchors.copper_share * numbers.motor_speed_rad_s)

    @cached_property
    def kr300_limits(self) -> tuple[Array, Array]:
        """Effort [Nm] and speed limits [rad/s] of the KR300, interpolated over the rated payload."""
        small, large = (self.files[name] for name in self.anchors.kr300_between)
        payloads = np.log([small.rated_payload_kg, self.kr300.rated_payload_kg, large.rated_payload_kg])
        share = (payloads[1] - payloads[0]) / (payloads[2] - payloads[0])
        effort, velocity = (_between(a, b, share) for a, b in zip(limits(small), limits(large), strict=True))
        return effort, velocity

    @cached_property
    def kr300_numbers(self) -> JointNumbers:
        """Numbers of the KR300; its copper loss is that of the reference robot's numbers, as none is published."""
        effort, velocity = self.kr300_limits
        friction = self.kr300.friction
        identified = np.radians(self.kr300.identified_up_to_deg_per_s)
        thinning = np.minimum(identified / velocity, 1.0) ** (1.0 - VISCOUS_EXPONENT)
        numbers = JointNumbers.of(
            effort,
            velocity,
            {
                "gear_ratio": np.array(self.kr300.gear_ratio),
                "rotor_inertia_kg_m2": np.array(self.kr300.rotor_inertia_kg_m2),
                "coulomb_nm": np.array(friction.coulomb_nm) + np.array(friction.tanh_nm),
                "viscous_nm_s_per_rad": np.array(friction.viscous_nm_s_per_rad) * thinning,
                "copper_w_per_nm2": np.ones(6),
            },
        )
        return replace(numbers, copper_w_per_nm=self.reference_numbers.copper_w_per_nm)

    def is_cobot(self, name: str) -> bool:
        """Whether an arm of the catalog is a collaborative one."""
        return name in self.anchors.cobots.names

    def numbers(self, name: str, effort: Array) -> JointNumbers:
        """Numbers of one arm of the catalog."""
        return self.numbers_at(effort, limits(self.files[name])[1], cobot=self.is_cobot(name))

    def numbers_at(
        self, effort: Array, velocity: Array, *, cobot: bool, roles: Sequence[int] = SIX_ROLES
    ) -> JointNumbers:
        """Numbers of any arm.

        Args:
            effort: Effort limits, shape (n,). [Nm]
            velocity: Velocity limits, shape (n,). [rad/s]
            cobot: Whether it is a collaborative arm.
            roles: Joint of a six-axis arm, counted from 0, that each of its joints stands for.
        """
        roles = list(roles)
        reference = {name: values[roles] for name, values in vars(self.reference_numbers).items()}
        if cobot:
            return JointNumbers(**reference | self._cobot_friction(velocity, roles))
        small, large = limits(self.reference)[0][roles], self.kr300_limits[0][roles]
        share = np.clip(np.log(effort / small) / np.log(large / small), 0.0, 1.0)
        kr300 = {name: values[roles] for name, values in vars(self.kr300_numbers).items()}
        return JointNumbers(**{name: _between(small, kr300[name], share) for name, small in reference.items()})

    def _cobot_friction(self, velocity: Array, roles: list[int]) -> dict[str, Array]:
        cobots = self.anchors.cobots
        of_effort, of_velocity = (values[roles] for values in limits(self.files[cobots.friction_of]))
        return {
            "motor_speed_rad_s": cobots.gear_ratio * velocity,
            "coulomb_share": np.array(cobots.coulomb_nm)[roles] / of_effort,
            "viscous_share": np.array(cobots.viscous_nm_s_per_rad)[roles] * of_velocity / of_effort,
        }

    @cached_property
    def power_exponent(self) -> float:
        """Exponent p of base power over installed power."""
        large, small = self.files[self.anchors.large], self.reference
        idle = self.anchors.large_idle_w / self.anchors.fitted_idle_w
        return float(np.log(idle) / np.log(large.installed_power_w / small.installed_power_w))

    def base_power_w(self, installed_w: float, *, cobot: bool) -> float:
        """Base power of an arm with an installed power [W], which counts for industrial arms alone. [W]"""
        cobots, reference = self.anchors.cobots, self.reference
        if cobot:
            return cobots.controller_power_w + cobots.arm_power_w / cobots.supply_efficiency
        share = installed_w / reference.installed_power_w
        return float(reference.drives.base_power_w * share**self.power_exponent)

    def effort_nm(self, name: str) -> Array:
        """Effort limits from static and dynamic need, shape (6,). [Nm]"""
        return self.effort_rule(cobot=self.is_cobot(name)).effort_nm(self.files[name])

    def drives(self, file: RobotFile, *, cobot: bool, roles: Sequence[int] = SIX_ROLES) -> dict[str, Any]:
        """Scaled drives of an arm as a robot file has them; its limits count, see `numbers_at`."""
        effort, velocity = limits(file)
        numbers = self.numbers_at(effort, velocity, cobot=cobot, roles=roles).drives(effort, velocity)
        base_w = self.base_power_w(file.installed_power_w, cobot=cobot)
        reference, cobots = self.reference.drives, self.anchors.cobots
        efficiency, active_w = reference.inverter_efficiency, reference.drive_active_power_w * base_w
        active_w /= reference.base_power_w
        if cobot:
            efficiency = rounded(cobots.bus_efficiency * cobots.supply_efficiency)
            active_w = cobots.drive_active_power_w / cobots.supply_efficiency
        return {
            "provenance": "scaled from the UR10e and the KR16" if cobot else "scaled from the KR16 and the KR300",
            "base_power_w": rounded(base_w),
            "drive_active_power_w": rounded(active_w),
            "inverter_efficiency": efficiency,
            "regeneration_efficiency": reference.regeneration_efficiency,
            "torque_use": reference.torque_use,
            "torque_floor": reference.torque_floor,
            "filter_time_s": max(
                rounded(reference.filter_time_s * file.reach_m / self.reference.reach_m), LEAST_FILTER_TIME_S
            ),
            "least_cruise_share": reference.least_cruise_share,
            **({"supply": _supply(cobots)} if cobot else {}),
            "joints": {
                joint.name: {key: rounded(values[index]) for key, values in numbers.items()}
                for index, joint in enumerate(file.moving_joints)
            },
        }

    @cached_property
    def own_rules(self) -> dict[str, EffortRule]:
        """Constants of every arm with published effort limits, by name."""
        return {
            name: EffortRule.of(file, counterbalanced=name in self.anchors.counterbalanced)
            for name, file in self.files.items()
            if file.provenance["effort"].kind == "published"
        }

    def effort_rule(self, *, cobot: bool, without: str = "") -> EffortRule:
        """Rule for effort limits: medians over the arms with published ones.

        Args:
            cobot: Over collaborative instead of industrial arms.
            without: Name of an arm to leave out (cross-validation).
        """
        cobots = self.anchors.cobots.names
        rules = [rule for name, rule in self.own_rules.items() if name != without and (name in cobots) == cobot]
        return EffortRule(*np.nanmedian([astuple(rule) for rule in rules], axis=0))

    def rebuild(self, name: str, data: dict[str, Any]) -> dict[str, Any]:
        """Catalog entry with all scaled figures computed anew.

        Args:
            name: Catalog name.
            data: Plain data of the entry.
        """
        file = self.files[name]
        cobot = self.is_cobot(name)
        joints = [joint for joint in data["joints"] if joint["type"] != "fixed"]
        if file.provenance["effort"].kind == "scaled":
            for joint, effort in zip(joints, self.effort_nm(name), strict=True):
                joint["effort_nm"] = rounded(effort)
            data["provenance"]["effort"]["note"] = EFFORT_NOTE
        for joint in joints:  # with more, the KR210 would leave the spread of a measured cell (docs/robots.md)
            joint["peak_effort_nm"] = joint["effort_nm"]
        data["provenance"]["peak_effort"] = {"kind": "assumed", "note": _PEAK_NOTE}
        data["drives"] = self.drives(parse(RobotFile, data, name), cobot=cobot)
        friction_published = name == self.anchors.cobots.friction_of
        note = COBOT_NOTE if cobot else INDUSTRIAL_NOTE
        data["provenance"]["drives"]["note"] = _FRICTION_NOTE + note if friction_published else note
        data["provenance"]["capsules"]["note"] = _CAPSULES_NOTE
        if cobot:
            data["provenance"]["supply"] = {"kind": "assumed", "note": supply_note(self.anchors.cobots)}
        capsules = derive_capsules(parse(RobotFile, data, name))
        data["capsules"] = {link: [c.model_dump(mode="json") for c in shapes] for link, shapes in capsules.items()}
        return data


def _supply(cobots: CobotAnchors) -> dict[str, float]:
    return {"controller_power_w": cobots.controller_power_w, "efficiency": cobots.supply_efficiency}


def supply_note(cobots: CobotAnchors) -> str:
    """What is known of the power between the mains and the arm, with its ranges."""
    arm, controller, supply = (
        f"{low:g}-{high:g}"
        for low, high in (cobots.arm_power_range_w, cobots.controller_power_range_w, cobots.supply_efficiency_range)
    )
    return (
        f"controller ({controller} W) and efficiency of the supply ({supply}) assumed, as no mains power with joint "
        f"data is published; electronics of the arm measured on its bus of 48 V, {arm} W on three arms "
        "(docs/validation-ur3e.md)"
    )


EFFORT_NOTE = (
    "scaled: joint 2 from its largest gravity torque and an acceleration time in proportion to the reach, joint 5 from "
    "its largest gravity torque, the others in proportion; constants are medians over arms with published limits "
    "(robojoule.robots.scaling)"
)
_PEAK_NOTE = "the published limits taken as peak limits"
INDUSTRIAL_NOTE = (
    "scaled between the fitted KR16 R2010 and the identified KR300 R2500 by similarity (robojoule.robots.scaling)"
)
COBOT_NOTE = (
    "scaled: friction shares of the identified UR10e, rotors of the fitted KR16 R2010, copper and gears assumed "
    "(robojoule.robots.scaling)"
)
_FRICTION_NOTE = "friction published (github.com/shamilmamedov/dynamic_calibration); the rest "
_CAPSULES_NOTE = "scaled: derived from the kinematics (robojoule.robots.collision.derive_capsules)"


def load_scaling() -> Scaling:
    """The laws over the whole catalog."""
    return Scaling(load_anchors(), load_kr300(), {name: load_robot_file(name) for name in list_robots()})


def rebuilt_entries() -> dict[str, dict[str, Any]]:
    """All scaled entries of the catalog as the laws give them now, by name."""
    scaling = load_scaling()
    for name, file in list(scaling.files.items()):  # scaled efforts first: installed power depends on them
        if file.provenance["effort"].kind == "scaled":
            efforts = iter(scaling.effort_nm(name))
            joints = [
                j if j.type == "fixed" else j.model_copy(update={"effort_nm": rounded(next(efforts))})
                for j in file.joints
            ]
            scaling.files[name] = file.model_copy(update={"joints": joints})
    return {
        name: scaling.rebuild(name, read_document(catalog_path(name)))
        for name, file in scaling.files.items()
        if file.provenance["drives"].kind == "scaled"
    }


def _between(small: Array, large: Array, share: Array | float) -> Array:
    """Geometric interpolation."""
    return np.asarray(small ** (1.0 - share) * large**share)


def rounded(value: float) -> float:
    """A scaled figure with the digits that are worth writing down."""
    return float(f"{value:.{DIGITS}g}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Rebuild the scaled entries of the catalog; with --check only say which would change (exit code 1)."""
    parser = argparse.ArgumentParser(prog="python -m robojoule.robots.scaling", description=main.__doc__)
    parser.add_argument("--check", action="store_true", help="change nothing")
    check = parser.parse_args(arguments).check
    stale = {name: data for name, data in rebuilt_entries().items() if data != read_document(catalog_path(name))}
    for name, data in stale.items():
        if not check:
            write_document(catalog_path(name), data)
        print(f"{name}: {'would change' if check else 'rebuilt'}")
    return 1 if check and stale else 0


if __name__ == "__main__":
    raise SystemExit(main())
