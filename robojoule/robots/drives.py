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
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array


@dataclass(frozen=True)
class DriveParameters:
    """All parameters of the drive model and the controller: the one typed place.

    Attributes:
        gear_ratio: Motor turns per joint turn, shape (n,). [-]
        rotor_inertia_kg_m2: Rotor inertia on the motor side, shape (n,). [kg m2]
        coulomb_nm: Coulomb friction on the link side, shape (n,). [Nm]
        viscous_nm_s_per_rad: Viscous friction on the link side, shape (n,). [Nm s/rad]
        copper_w_per_nm2: Copper loss per squared motor torque, shape (n,). [W/Nm2]
        base_power_w: Power of the controller with drives enabled and no torque. [W]
        drive_active_power_w: Additional constant power while moving. [W]
        inverter_efficiency: Share of mains power that reaches the DC bus. [-]
        regeneration_efficiency: Share of surplus bus power returned to the mains. [-]
        torque_use: Share of the effort limit that the controller's acceleration may use. [-]
        torque_floor: Share of the effort limit always left for acceleration. [-]
        filter_time_s: Acceleration divided by jerk: length of a jerk phase. [s]
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


def idle_power_w(drives: DriveParameters, gravity_nm: Array) -> Array:
    """Mains power at rest while holding gravity.

    Args:
        drives: Drive parameters.
        gravity_nm: Gravity torque, shape (..., n). [Nm]

    Returns:
        Idle power, shape (...). [W]
    """
    copper = gravity_nm**2 @ drives.copper_w_per_joint_nm2
    return np.asarray(drives.base_power_w + copper / drives.inverter_efficiency)


def mains_power_w(drives: DriveParameters, bus_power_w: Array) -> Array:
    """Mains power while moving.

    Args:
        drives: Drive parameters.
        bus_power_w: Sum of the joints' electrical power, shape (...). [W]

    Returns:
        Mains power, shape (...). [W]
    """
    drawn = np.maximum(bus_power_w, 0.0) / drives.inverter_efficiency
    returned = drives.regeneration_efficiency * np.maximum(-bus_power_w, 0.0)
    return np.asarray(drives.base_power_w + drives.drive_active_power_w + drawn - returned)
