"""The energy model as a function of its drive parameters, with derivatives.

With the rigid-body and rotor torque l_j, the velocity qd_j, the direction s_j = sign(qd_j) and the gear ratio i_j,

    tau_j = l_j + Fc_j s_j + Fv_j qd_j
    P_bus = sum_j (tau_j qd_j + k_j (tau_j / i_j)^2)
    P     = base + active m + g max(P_bus, 0) - rho max(-P_bus, 0) ,   g = 1 / eta ,

m = 1 while any joint moves, else 0. Within a regime of the bus (P_bus > 0: driving, P_bus < 0: braking) and for given
copper torques this is linear in (base, active, g, g Fc, g Fv, g k) and (base, active, rho, rho Fc, ...), respectively.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.signals import Signals
from robojoule.robots.robot import Robot

LEAST_EFFICIENCY = 0.5  # no industrial inverter is worse
SCALARS = ("base_power_w", "drive_active_power_w", "inverter_efficiency", "regeneration_efficiency")
JOINT_KEYS = ("coulomb_nm", "viscous_nm_s_per_rad", "copper_w_per_nm2")


@dataclass(frozen=True)
class ParameterSpace:
    """Order, start, scale and bounds of the P parameters; the efficiency enters as its reciprocal.

    Attributes:
        names: Keys as in a robot file's `drives` section, P strings.
        start: The catalog's values, shape (P,).
        scale: Sizes that make the parameters comparable: a change that would matter, shape (P,).
        lower: Physical lower bounds, shape (P,).
        upper: Physical upper bounds, shape (P,).
        gear_ratio: Gear ratios, shape (n,). [-]
    """

    names: tuple[str, ...]
    start: Array
    scale: Array
    lower: Array
    upper: Array
    gear_ratio: Array


def parameter_space(robot: Robot) -> ParameterSpace:
    """The parameters of a robot's drives."""
    drives, n = robot.drives, robot.joint_count
    share = 0.02 * robot.effort_nm
    joints = np.concatenate(
        [drives.coulomb_nm, drives.viscous_nm_s_per_rad, drives.copper_w_per_nm2],
    )
    typical = np.concatenate([share, share / robot.velocity_rad_s, np.full(n, np.median(drives.copper_w_per_nm2))])
    base = max(drives.base_power_w, 1.0)
    copper = np.maximum(joints[2 * n :], np.maximum(typical[2 * n :], 1e-6))
    scale = np.concatenate([[base, 0.1 * base, 0.2, 1.0], np.maximum(joints[: 2 * n], typical[: 2 * n]), copper])
    reciprocal = min(1.0 / drives.inverter_efficiency, 1.0 / LEAST_EFFICIENCY)
    return ParameterSpace(
        names=(*SCALARS, *(f"joints.{name}.{key}" for key in JOINT_KEYS for name in robot.joint_names)),
        start=np.concatenate(
            [[drives.base_power_w, drives.drive_active_power_w, reciprocal, drives.regeneration_efficiency], joints]
        ),
        scale=scale,
        lower=np.concatenate([[0.0, 0.0, 1.0, 0.0], np.zeros(3 * n)]),
        upper=np.concatenate([[np.inf, np.inf, 1.0 / LEAST_EFFICIENCY, 1.0], np.full(3 * n, np.inf)]),
        gear_ratio=drives.gear_ratio,
    )


@dataclass(frozen=True)
class Evaluation:
    """The model at one parameter vector: T instants, W windows, P parameters, n joints.

    Attributes:
        power_w: Modelled mains power, shape (T,). [W]
        bus_w: Modelled bus power, shape (T,). [W]
        window_power_w: Its averages over windows, shape (W,). [W]
        jacobian: Derivatives of `window_power_w`, shape (W, P).
        torque_nm: Modelled drive torques, shape (T, n). [Nm]
    """

    power_w: Array
    bus_w: Array
    window_power_w: Array
    jacobian: Array
    torque_nm: Array


def evaluate(space: ParameterSpace, signals: Signals, theta: Array, *, use_measured_torque: bool = False) -> Evaluation:
    """Evaluate the model and its derivatives.

    Args:
        space: Parameter order.
        signals: Prepared log.
        theta: Parameters, shape (P,).
        use_measured_torque: Put the logged torques, not the modelled ones, into the bus power; friction then has no
            influence on power.
    """
    n = len(space.gear_ratio)
    base, active, reciprocal, returned = theta[:4]
    coulomb, viscous, copper = theta[4 : 4 + n], theta[4 + n : 4 + 2 * n], theta[4 + 2 * n :]
    velocity, direction = signals.velocity_rad_s, signals.direction
    modelled = signals.load_nm + coulomb * direction + viscous * velocity
    measured = signals.torque_nm if use_measured_torque else None
    torque = modelled if measured is None else measured
    motor_square = (torque / space.gear_ratio) ** 2
    bus = (torque * velocity).sum(axis=1) + motor_square @ copper
    drawn, surplus = np.maximum(bus, 0.0), np.maximum(-bus, 0.0)
    power = base + active * signals.moving + reciprocal * drawn - returned * surplus
    by_bus = np.where(bus > 0.0, reciprocal, returned)[:, None]
    jacobian = np.empty((len(signals.window_start), len(theta)))
    jacobian[:, 0] = 1.0
    jacobian[:, 1] = signals.average(signals.moving.astype(float))
    jacobian[:, 2] = signals.average(drawn)
    jacobian[:, 3] = signals.average(-surplus)
    if measured is None:
        by_torque = by_bus * (velocity + 2.0 * torque * copper / space.gear_ratio**2)
        jacobian[:, 4 : 4 + n] = signals.average(by_torque * direction)
        jacobian[:, 4 + n : 4 + 2 * n] = signals.average(by_torque * velocity)
    else:
        jacobian[:, 4 : 4 + 2 * n] = 0.0
    jacobian[:, 4 + 2 * n :] = signals.average(by_bus * motor_square)
    return Evaluation(power, bus, signals.average(power), jacobian, modelled)
