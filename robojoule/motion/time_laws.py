"""Time laws along a joint-space path: jerk limited, from rest to rest, synchronised over the joints.

A motion moves along q(s), s from 0 to 1. All joints share s(t), so one path coordinate with limits on its velocity,
acceleration and jerk is the whole trajectory (KUKA PTP and UR movej are synchronised likewise). Ruckig computes single
laws where it is installed. From rest to rest the law is symmetric and known in closed form, which serves where many
motions run at many speed limits at once: with acceleration a, jerk j = a / T_f and peak velocity v,

    T_a = v/a + T_f             if v >= a T_f,        else 2 sqrt(v/j)           (time to reach v from rest)
    d   = 1/v + T_a                                    as long as v T_a <= 1      (v is reached)
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from types import ModuleType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index
from robojoule.errors import MissingPackage, RobojouleError

LawEngine = Literal["ruckig", "closed_form"]
ROUNDING = 1e-9  # a peak velocity counts as reached when the path is too short by less than this share
PHASES = 7  # jerk up, constant acceleration, jerk down, cruise, and the mirror image


@dataclass(frozen=True)
class PathLaw:
    """Time law s(t) of one run in seven phases of constant jerk; of many runs where arrays have leading axes.

    Attributes:
        duration_s: Length of each phase, shape (..., 7). [s]
        jerk: Path jerk in each phase, shape (..., 7). [1/s3]
        acceleration: Path acceleration at the start of each phase, shape (..., 7). [1/s2]
        velocity: Path velocity at the start of each phase, shape (..., 7). [1/s]
        position: Path position at the start of each phase, shape (..., 7). [-]
    """

    duration_s: Array
    jerk: Array
    acceleration: Array
    velocity: Array
    position: Array

    def of(self, rows: slice | Index) -> PathLaw:
        """Some of many laws, by their first axis."""
        return PathLaw(*(getattr(self, field.name)[rows] for field in fields(self)))

    @property
    def total_s(self) -> float:
        """Duration of a single run. [s]"""
        return float(self.duration_s.sum())

    def at(self, time_s: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Evaluate the law of a single run.

        Args:
            time_s: Instants within [0, duration], shape (T,). [s]

        Returns:
            Position [-], velocity [1/s], acceleration [1/s2] and jerk [1/s3], each of shape (T,).
        """
        times = np.asarray(time_s, dtype=float)
        starts = np.concatenate([[0.0], np.cumsum(self.duration_s)[:-1]])
        # An instant on a boundary belongs to the phase that starts there; empty phases own no instant.
        phase = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, PHASES - 1)
        tau = times - starts[phase]
        j, a, v, p = (x[phase] for x in (self.jerk, self.acceleration, self.velocity, self.position))
        return (
            p + tau * (v + tau * (a / 2 + tau * j / 6)),
            v + tau * (a + tau * j / 2),
            a + tau * j,
            j,
        )


def path_law(
    velocity: ArrayLike,
    acceleration: ArrayLike,
    filter_time_s: float,
    *,
    length_rad: ArrayLike = 1.0,
    engine: LawEngine | None = None,
) -> PathLaw:
    """Fastest laws from rest to rest within limits of velocity, acceleration and jerk = acceleration / filter time.

    Args:
        velocity: Largest path velocities, any shape; beyond what the path lets reach they change nothing. [1/s]
        acceleration: Largest path accelerations, the same shape. [1/s2]
        filter_time_s: Length of a full jerk phase. [s]
        length_rad: Lengths that Ruckig computes with, e.g. the largest joint changes, as its tolerances have a scale;
            one, or as many as can be broadcast to the velocities. [rad]
        engine: What computes them; if not given, Ruckig a single law where it is installed, many the closed form.

    Returns:
        The laws, with arrays of shape (..., 7).

    Raises:
        MissingPackage: Ruckig is asked for and not installed.
        RobojouleError: Ruckig found no trajectory.
    """
    v, a = np.asarray(velocity, dtype=float), np.asarray(acceleration, dtype=float)
    if engine is None:
        engine = "ruckig" if v.ndim == 0 and installed_ruckig() is not None else "closed_form"
    if engine == "closed_form":
        return _in_closed_form(v, a, filter_time_s)
    return _by_ruckig(v, a, filter_time_s, np.broadcast_to(np.asarray(length_rad, dtype=float), v.shape))


@cache
def installed_ruckig() -> ModuleType | None:
    """The package Ruckig, None where it is not installed."""
    try:
        import ruckig as package
    except ImportError:
        return None
    return package  # type: ignore[no-any-return]


def _by_ruckig(velocity: Array, acceleration: Array, filter_time_s: float, length_rad: Array) -> PathLaw:
    package = installed_ruckig()
    if package is None:
        raise MissingPackage("a time law by Ruckig", "ruckig")
    generator, problem, trajectory = package.Ruckig(1), package.InputParameter(1), package.Trajectory(1)
    laws = np.empty((velocity.size, len(fields(PathLaw)), PHASES))
    limits = np.stack([length_rad, velocity * length_rad, acceleration * length_rad], axis=-1).reshape(-1, 3)
    for law, (length, v, a) in zip(laws, limits.tolist(), strict=True):
        jerk = a / filter_time_s
        problem.target_position = [length]
        problem.max_velocity, problem.max_acceleration, problem.max_jerk = [v], [a], [jerk]
        result = generator.calculate(problem, trajectory)
        if result not in (package.Result.Working, package.Result.Finished):
            raise RobojouleError(
                f"Ruckig found no trajectory over {length:.6g} rad with velocity {v:.6g} rad/s, "
                f"acceleration {a:.6g} rad/s2, jerk {jerk:.6g} rad/s3 ({result})"
            )
        profile = trajectory.profiles[0][0]
        law[:] = profile.t, profile.j, profile.a[:PHASES], profile.v[:PHASES], profile.p[:PHASES]
    laws[:, 1:] /= limits[:, :1, None]
    return PathLaw(*laws.swapaxes(0, 1).reshape(-1, *velocity.shape, PHASES))


def _in_closed_form(velocity: Array, acceleration: Array, filter_time_s: float) -> PathLaw:
    top = reachable_velocity(acceleration, filter_time_s)
    velocity = np.where(velocity > top * (1.0 + ROUNDING), top, velocity)
    jerk = acceleration / filter_time_s
    full = velocity >= acceleration * filter_time_s
    ramp = np.where(full, filter_time_s, np.sqrt(velocity / jerk))
    plateau = np.where(full, velocity / acceleration - filter_time_s, 0.0)
    cruise = np.maximum(1.0 / velocity - 2.0 * ramp - plateau, 0.0)
    peak = jerk * ramp  # acceleration on the plateau
    rise = peak * ramp / 2.0  # velocity gained in a jerk phase
    first = peak * ramp**2 / 6.0
    second = first + plateau * (rise + peak * plateau / 2.0)
    third = velocity * (2.0 * ramp + plateau) / 2.0
    none = np.zeros_like(velocity)
    return PathLaw(
        duration_s=np.stack([ramp, plateau, ramp, cruise, ramp, plateau, ramp], axis=-1),
        jerk=np.stack([jerk, none, -jerk, none, -jerk, none, jerk], axis=-1),
        acceleration=np.stack([none, peak, peak, none, none, -peak, -peak], axis=-1),
        velocity=np.stack([none, rise, velocity - rise, velocity, velocity, velocity - rise, rise], axis=-1),
        position=np.stack([none, first, second, third, 1.0 - third, 1.0 - second, 1.0 - first], axis=-1),
    )


def ramp_time_s(velocity: ArrayLike, acceleration: ArrayLike, filter_time_s: ArrayLike) -> Array:
    """Time to reach a velocity from rest with jerk = acceleration / filter time.

    Args:
        velocity: Peak path velocity. [1/s]
        acceleration: Largest path acceleration. [1/s2]
        filter_time_s: Length of a full jerk phase. [s]

    Returns:
        Ramp time, broadcast shape of the arguments. [s]
    """
    v, a, jerk_s = (np.asarray(x, dtype=float) for x in (velocity, acceleration, filter_time_s))
    full: Array = v / a + jerk_s
    short: Array = 2.0 * np.sqrt(v * jerk_s / a)
    return np.where(v >= a * jerk_s, full, short)


def duration_at_peak_s(velocity: ArrayLike, acceleration: ArrayLike, filter_time_s: ArrayLike) -> Array:
    """Duration of the unit path at a peak velocity; infinite where that velocity cannot be reached on it.

    Arguments as in `ramp_time_s`; returns their broadcast shape. [s]
    """
    v = np.asarray(velocity, dtype=float)
    ramp = ramp_time_s(v, acceleration, filter_time_s)
    return np.where(v * ramp <= 1.0 + ROUNDING, 1.0 / v + ramp, np.inf)


def reachable_velocity(acceleration: ArrayLike, filter_time_s: ArrayLike, ramp_share: float = 1.0) -> Array:
    """Highest peak velocity with v T_a(v) <= ramp_share; with 1 that of the fastest law without a velocity limit.

    Args:
        acceleration: Largest path acceleration. [1/s2]
        filter_time_s: Length of a full jerk phase. [s]
        ramp_share: Share of the path that both ramps may take. [-]

    Returns:
        Velocity, shape of `acceleration`. [1/s]
    """
    a, jerk_s = np.asarray(acceleration, dtype=float), np.asarray(filter_time_s, dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        with_plateau = a / 2.0 * (np.sqrt(jerk_s**2 + 4.0 * ramp_share / a) - jerk_s)
    without = (a / jerk_s * ramp_share**2 / 4.0) ** (1.0 / 3.0)
    return np.asarray(np.where(with_plateau >= a * jerk_s, with_plateau, without))
