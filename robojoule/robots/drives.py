"""Electrical drive model: joint torque -> motor -> shared DC bus -> mains.

Per joint j, with link-side torque tau (rigid body, friction and rotor inertia together), joint velocity qd and gear
ratio i, the electrical power is the mechanical power plus the copper loss,

    P_j = tau_j qd_j + k_j (tau_j / i_j)^2 ,

with k the copper loss per squared motor torque [W/Nm^2]. All joints share one DC bus, so a joint that brakes feeds one
that accelerates. What the bus cannot use burns in the brake chopper (or partly returns to the mains):

    P_mains = P_base + P_active + max(P_bus, 0) / eta - rho max(-P_bus, 0) ,   P_bus = sum_j P_j ,

with eta the inverter efficiency, rho the regeneration efficiency (0 for a plain chopper), P_base the controller's base
power and P_active the constant power of active drives while moving. At rest, friction holds nothing and motors hold
gravity: P_idle(q) = P_base + sum_j k_j (g_j(q) / i_j)^2 / eta.

With l_j the torque that the gear transmits (rigid body and rotor) and s_j the direction of the motion, friction adds

    tau_j = l_j + s_j (C_j + mu_j |l_j|) + B_j qd_j .

Controllers of collaborative arms measure power on a bus of 48 V that feeds the arm (`Supply`): the law there is the
same, with the arm's share of the base power and without the losses of the supply.

This is the one place of the law and of its derivatives. Simulation, path integrals and logs differ only in where their
states come from and in how they sum over time: P_bus vanishes where its sign changes, so derivatives of what the mains
deliver are sums of those of P_bus with weight 1 / eta while it is drawn and rho while it is fed back.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array

LEAST_CRUISE_SHARE = 0.1  # of controllers of which nothing else is known

Gradient = dict[str, Array]
"""Derivatives of powers [W] or energies [J] by the names of `DriveParameters`."""


@dataclass(frozen=True, eq=False)
class DriveParameters:
    """All parameters of the drive model and the controller: the one typed place.

    Attributes:
        gear_ratio: Motor turns per joint turn, shape (n,). [-]
        rotor_inertia_kg_m2: Rotor inertia on the motor side, shape (n,). [kg m2]
        coulomb_nm: Coulomb friction on the link side, shape (n,). [Nm]
        viscous_nm_s_per_rad: Viscous friction on the link side, shape (n,). [Nm s/rad]
        copper_w_per_nm2: Copper loss per squared motor torque, shape (n,). [W/Nm2]
        base_power_w: Power with drives enabled and no torque: controller, supply and electronics of the arm. [W]
        drive_active_power_w: Additional constant power while moving. [W]
        inverter_efficiency: Share of mains power that reaches the DC bus. [-]
        regeneration_efficiency: Share of surplus bus power returned to the mains. [-]
        torque_use: Share of the peak torque that the controller's acceleration may use. [-]
        torque_floor: Share of the peak torque left for acceleration where less would be, as far as the peak allows. [-]
        filter_time_s: Acceleration divided by jerk: length of a jerk phase. [s]
        least_cruise_share: Least share of a run's duration at constant velocity; caps the velocity at full speed. [-]
        load_friction: Friction per transmitted torque (gear mesh loss), shape (n,) or one value for all joints. [-]
    """

    gear_ratio: Array
    rotor_inertia_kg_m2: Array
    coulomb_nm: Array
    viscous_nm_s_per_rad: Array
    copper_w_per_nm2: Array
    base_power_w: float
    drive_active_power_w: float
    inverter_efficiency: float
    regeneration_efficiency: float
    torque_use: float
    torque_floor: float
    filter_time_s: float
    least_cruise_share: float = LEAST_CRUISE_SHARE
    load_friction: Array | float = 0.0

    def friction_nm(self, direction: Array, velocity_rad_s: Array, load_nm: Array) -> Array:
        """Friction torque on the link side: Coulomb, viscous and load-dependent.

        Args:
            direction: Sign of the motion, so that Coulomb friction also acts as the motion starts, shape (..., n). [-]
            velocity_rad_s: Joint velocities, shape (..., n). [rad/s]
            load_nm: Torques that the gears transmit (rigid body and rotor), shape (..., n). [Nm]

        Returns:
            Friction torques, broadcast shape of the arguments. [Nm]
        """
        friction = self.coulomb_nm * direction + self.viscous_nm_s_per_rad * velocity_rad_s
        if np.any(self.load_friction):
            friction = friction + self.load_friction * np.abs(load_nm) * direction
        return friction

    @property
    def reflected_inertia_kg_m2(self) -> Array:
        """Rotor inertia seen at the joint, gear^2 J, shape (n,). [kg m2]"""
        return self.gear_ratio**2 * self.rotor_inertia_kg_m2

    @property
    def copper_w_per_joint_nm2(self) -> Array:
        """Copper loss per squared link-side torque, shape (n,). [W/Nm2]"""
        return self.copper_w_per_nm2 / self.gear_ratio**2


@dataclass(frozen=True)
class Supply:
    """What lies between the mains and the bus of a collaborative arm, on which its controller measures power:

        P_mains = P_controller + P_arm / eta_supply

    Attributes:
        controller_power_w: Power of the controller's computer and fans at the mains. [W]
        efficiency: Share of the rest that reaches the arm's bus. [-]
    """

    controller_power_w: float
    efficiency: float

    def arm_side(self, drives: DriveParameters) -> DriveParameters:
        """Drives seen from the arm's bus, from those seen from the mains."""
        return replace(
            drives,
            base_power_w=(drives.base_power_w - self.controller_power_w) * self.efficiency,
            drive_active_power_w=drives.drive_active_power_w * self.efficiency,
            inverter_efficiency=min(drives.inverter_efficiency / self.efficiency, 1.0),
        )

    def mains_side(self, drives: DriveParameters) -> DriveParameters:
        """Drives seen from the mains, from those seen from the arm's bus: the inverse of `arm_side`."""
        return replace(
            drives,
            base_power_w=self.controller_power_w + drives.base_power_w / self.efficiency,
            drive_active_power_w=drives.drive_active_power_w / self.efficiency,
            inverter_efficiency=drives.inverter_efficiency * self.efficiency,
        )


@dataclass(frozen=True)
class DrivePowers:
    """Torques and powers of drives in some states, n joints.

    Attributes:
        torque_nm: Link-side torques incl. friction and rotor inertia, shape (..., n). [Nm]
        friction_w: Power lost in joint friction, shape (...). [W]
        copper_w: Power lost in motor copper, shape (...). [W]
        bus_w: Power that the joints take from the DC bus, negative when they feed it, shape (...). [W]
    """

    torque_nm: Array
    friction_w: Array
    copper_w: Array
    bus_w: Array


def drive_powers(drives: DriveParameters, direction: Array, velocity_rad_s: Array, load_nm: Array) -> DrivePowers:
    """From transmitted torques to the power on the bus; arguments as for `DriveParameters.friction_nm`."""
    friction = drives.friction_nm(direction, velocity_rad_s, load_nm)
    friction_w = np.einsum("...n,...n->...", friction, velocity_rad_s)
    torque = np.add(load_nm, friction, out=friction)
    return DrivePowers(torque, friction_w, *copper_and_bus_w(drives, torque, velocity_rad_s))


def copper_and_bus_w(drives: DriveParameters, torque_nm: Array, velocity_rad_s: Array) -> tuple[Array, Array]:
    """Copper loss and bus power of drive torques.

    Args:
        drives: Drive parameters.
        torque_nm: Link-side torques of the drives, shape (..., n). [Nm]
        velocity_rad_s: Joint velocities, shape (..., n). [rad/s]

    Returns:
        Power lost in motor copper and power taken from the DC bus, each of shape (...). [W]
    """
    bus = np.einsum("...n,...n->...", torque_nm, velocity_rad_s)
    copper = np.einsum("n,...n->...", drives.copper_w_per_joint_nm2, torque_nm**2)
    bus += copper
    return copper, bus


def bus_gradient(
    drives: DriveParameters, direction: Array, velocity_rad_s: Array, load_nm: Array, torque_nm: Array, weight: Array
) -> tuple[Gradient, Array]:
    """Derivatives of the weighted bus power, of `DriveParameters`' own friction.

    Args:
        drives: Drive parameters.
        direction: See `DriveParameters.friction_nm`.
        velocity_rad_s: Likewise.
        load_nm: Likewise.
        torque_nm: Drive torques of these states, see `drive_powers`. [Nm]
        weight: Weight of each state, shape (..., 1).

    Returns:
        Those after the figures of each joint, and those after the transmitted torques, all of shape (..., n).
    """
    along = weight * (velocity_rad_s + 2.0 * drives.copper_w_per_joint_nm2 * torque_nm)
    gradient = {
        "coulomb_nm": along * direction,
        "viscous_nm_s_per_rad": along * velocity_rad_s,
        "load_friction": along * direction * np.abs(load_nm),
        "copper_w_per_nm2": weight * (torque_nm / drives.gear_ratio) ** 2,
    }
    return gradient, along * (1.0 + drives.load_friction * direction * np.sign(load_nm))


def idle_power_w(drives: DriveParameters, gravity_nm: Array) -> Array:
    """Mains power at rest while holding gravity.

    Args:
        drives: Drive parameters.
        gravity_nm: Gravity torque, shape (..., n). [Nm]

    Returns:
        Idle power, shape (...). [W]
    """
    copper = gravity_nm**2 @ drives.copper_w_per_joint_nm2
    return mains_energy_j(drives, 1.0, copper, copper, active=0.0)


def mains_power_w(drives: DriveParameters, bus_power_w: Array, active: ArrayLike = 1.0) -> Array:
    """Mains power.

    Args:
        drives: Drive parameters.
        bus_power_w: Sum of the joints' electrical power, shape (...). [W]
        active: 1 while the robot moves, 0 while it stands. [-]

    Returns:
        Mains power, shape (...). [W]
    """
    return mains_energy_j(drives, 1.0, np.maximum(bus_power_w, 0.0), bus_power_w, active)


def mains_energy_j(
    drives: DriveParameters, duration_s: ArrayLike, drawn_j: Array, bus_j: Array, active: ArrayLike = 1.0
) -> Array:
    """Mains energy of a stretch of time, or mains power where the duration is 1.

    Args:
        drives: Drive parameters.
        duration_s: Its length, shape (...). [s]
        drawn_j: Integral of the positive part of the bus power, shape (...). [J]
        bus_j: Integral of the bus power, shape (...). [J]
        active: Share of the time in which the robot moves. [-]

    Returns:
        Energy, shape (...). [J]
    """
    steady = (drives.base_power_w + drives.drive_active_power_w * np.asarray(active)) * np.asarray(duration_s)
    returned = drives.regeneration_efficiency * (drawn_j - bus_j)
    return np.asarray(steady + drawn_j / drives.inverter_efficiency - returned)


def mains_gradient(
    drives: DriveParameters, duration_s: ArrayLike, drawn_j: Array, bus_j: Array, active: ArrayLike = 1.0
) -> Gradient:
    """Derivatives of `mains_energy_j` after the figures that all joints share, each of shape (...)."""
    duration = np.asarray(duration_s)
    return {
        "base_power_w": duration,
        "drive_active_power_w": np.asarray(active) * duration,
        "inverter_efficiency": -drawn_j / drives.inverter_efficiency**2,
        "regeneration_efficiency": bus_j - drawn_j,
    }


def mains_weight(drives: DriveParameters, time: ArrayLike, drawing: Array) -> Array:
    """Derivative of `mains_energy_j` after the bus power of an instant.

    Args:
        drives: Drive parameters.
        time: Weight of the instant in integrals over time.
        drawing: Its weight in integrals over the times at which the bus draws power.
    """
    returned = drives.regeneration_efficiency
    return np.asarray(returned * np.asarray(time) + (1.0 / drives.inverter_efficiency - returned) * drawing)
