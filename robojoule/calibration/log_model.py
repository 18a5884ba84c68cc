"""The energy model of a log as a function of the drives' figures, with derivatives.

The law is that of `robojoule.robots.drives` at the log's instants, averaged over its windows: with g = 1 / eta,

    P = base + active m + g max(P_bus, 0) - rho max(-P_bus, 0) ,

m = 1 while any joint moves, else 0. Within a regime of the bus (P_bus > 0: driving, P_bus < 0: braking) and for given
copper torques this is linear in (base, active, g, g Fc, g Fv, g k) and (base, active, rho, rho Fc, ...), respectively.
That is why the efficiency is estimated as its reciprocal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.parameters import IDENTITY, RECIPROCAL, ParameterVector, group
from robojoule.calibration.signals import Signals
from robojoule.robots.drives import (
    bus_gradient,
    copper_and_bus_w,
    drive_powers,
    mains_gradient,
    mains_power_w,
    mains_weight,
)
from robojoule.robots.robot import Robot

LEAST_EFFICIENCY = 0.5  # no industrial inverter is worse
_TYPICAL_FRICTION = 0.02  # of the effort limit: a change of friction that matters where the entry has less
_LEAST_COPPER = 1e-6  # [W/Nm2]


def log_parameters(robot: Robot) -> ParameterVector:
    """What a log may tell of a robot's drives, starting from its entry; scales are changes that would matter."""
    drives = robot.drives
    base = max(drives.base_power_w, 1.0)
    friction = _TYPICAL_FRICTION * robot.effort_nm
    positive = (0.0, np.inf)
    copper = np.maximum(drives.copper_w_per_nm2, max(float(np.median(drives.copper_w_per_nm2)), _LEAST_COPPER))
    return ParameterVector(
        drives,
        (
            group(drives, "base_power_w", IDENTITY, base, bounds=positive),
            group(drives, "drive_active_power_w", IDENTITY, 0.1 * base, bounds=positive),
            group(drives, "inverter_efficiency", RECIPROCAL, 0.2, bounds=(1.0, 1.0 / LEAST_EFFICIENCY)),
            group(drives, "regeneration_efficiency", IDENTITY, 1.0, bounds=(0.0, 1.0)),
            group(drives, "coulomb_nm", IDENTITY, np.maximum(drives.coulomb_nm, friction), bounds=positive),
            group(
                drives,
                "viscous_nm_s_per_rad",
                IDENTITY,
                np.maximum(drives.viscous_nm_s_per_rad, friction / robot.velocity_rad_s),
                bounds=positive,
            ),
            group(drives, "copper_w_per_nm2", IDENTITY, copper, bounds=positive),
        ),
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


def evaluate(vector: ParameterVector, signals: Signals, x: Array, *, use_measured_torque: bool = False) -> Evaluation:
    """Evaluate the model and its derivatives.

    Args:
        vector: What the parameters are, see `log_parameters`.
        signals: Prepared log.
        x: Parameters, shape (P,).
        use_measured_torque: Put the logged torques, not the modelled ones, into the bus power; friction then has no
            influence on power.
    """
    drives = vector.drives(x)
    states = signals.direction, signals.velocity_rad_s, signals.load_nm
    modelled = drive_powers(drives, *states)
    torque, bus = modelled.torque_nm, modelled.bus_w
    measured = signals.torque_nm if use_measured_torque else None
    if measured is not None:
        torque, bus = measured, copper_and_bus_w(drives, measured, signals.velocity_rad_s)[1]
    moving, drawn = signals.moving.astype(float), np.maximum(bus, 0.0)
    power = mains_power_w(drives, bus, moving)
    weight = mains_weight(drives, 1.0, (bus > 0.0).astype(float))[:, None]
    gradient = mains_gradient(drives, np.ones_like(bus), drawn, bus, moving)
    gradient |= bus_gradient(drives, *states, torque, weight)[0]
    if measured is not None:
        gradient |= dict.fromkeys(("coulomb_nm", "viscous_nm_s_per_rad"), np.zeros_like(torque))
    averages = {part.figure: signals.average(gradient[part.figure]) for part in vector.groups}
    return Evaluation(power, bus, signals.average(power), vector.chain(averages, x), modelled.torque_nm)
