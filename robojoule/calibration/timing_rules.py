"""Rules by which a controller may make its time laws, as candidates for a fit: durations and their derivatives.

A candidate is a vector of P entries with a normal prior. Logarithms of path velocity and acceleration at full speed
are least ones over joints of expressions that are linear in the entries,

    ln v_m = min_j (L_v,j x + c_v,mj) ,    ln a_m = min_j (L_a,j x + c_a,mj) ,

and a run at speed limit p takes d = S(p v_m, a_m p^k, T_f) + t_0, S being the duration of the time law
(`robojoule.motion.time_laws`). ln T_f, t_0 and, where it is free, k are entries, too. Many data sets of the same runs,
B of them, are evaluated at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array, Index
from robojoule.motion.learnt_controller import reached_velocity
from robojoule.motion.simulation import MotionPaths
from robojoule.motion.time_laws import duration_at_peak_s
from robojoule.robots.controller_file import (
    MOST_AHEAD_S,
    MOST_DEAD_TIME_S,
    MOST_EXPONENT,
    AccelerationRule,
    ControllerTiming,
)
from robojoule.robots.robot import Robot

_STEP = 1e-5  # of logarithms, for derivatives
_LEAST_FILTER_S = 1e-4
# Standard deviations of what controllers differ by from the nominal entry.
VELOCITY_SPREAD = 0.1  # all joints alike
JOINT_VELOCITY_SPREAD = 0.02  # single joints beside that
FILTER_SPREAD = 0.7
DEAD_TIME_SPREAD_S = 0.01
FACTOR_SPREAD = 0.3  # of the torque-limited acceleration
JOINT_ACCELERATION_SPREAD = 0.7
LEADING_AXIS_SPREAD = 1.0
EXPONENT_SPREAD = 0.7
MIDDLE_EXPONENT = 0.5
OWN = "the entry's own"
_NO_SPREAD = 1e-7


@dataclass(frozen=True, eq=False)
class Candidate:
    """One rule, with M motions, n joints and P entries.

    Attributes:
        rule: Where accelerations come from.
        exponent: Power of the speed limit that scales accelerations; None: an entry of the vector.
        names: Names of the entries.
        mean: Their prior mean, shape (P,).
        spread: Their prior standard deviation, shape (P,).
        velocity: Derivatives of the joints' logarithms of velocity after the entries, shape (n, P).
        velocity_offset: Shape (M, n).
        acceleration: Those of accelerations, shape (n', P).
        acceleration_offset: Shape (M, n').
        cruise_share: Least share of cruise. [-]
        is_own: Whether it is the entry's own timing, of which nothing is fitted.
    """

    rule: AccelerationRule
    exponent: float | None
    names: tuple[str, ...]
    mean: Array
    spread: Array
    velocity: Array
    velocity_offset: Array
    acceleration: Array
    acceleration_offset: Array
    cruise_share: float
    is_own: bool = False

    @property
    def name(self) -> str:
        """What tables call it: the rule and the power of the speed limit."""
        if self.is_own:
            return OWN
        return f"{self.rule}, acceleration ~ limit^{'k' if self.exponent is None else f'{self.exponent:g}'}"

    def at(self, entry: str) -> int:
        """Place of an entry."""
        return self.names.index(entry)

    def evaluate(self, x: Array, motion: Index, limits: Array) -> tuple[Array, Array]:
        """Durations of runs and their derivatives.

        Args:
            x: Entries, shape (B, P).
            motion: Motion of each run, shape (R,).
            limits: Speed limit of each run, shape (B, R). [-]

        Returns:
            Durations (B, R) [s] and their derivatives after the entries (B, R, P).
        """
        ln_v, along_v = _least(self.velocity, self.velocity_offset, x)
        ln_a, along_a = _least(self.acceleration, self.acceleration_offset, x)
        ln_p = np.log(limits)
        power = x[:, self.at("exponent"), None] if self.exponent is None else self.exponent
        log_velocity = ln_v[:, motion] + ln_p
        log_acceleration = ln_a[:, motion] + power * ln_p
        log_filter = np.broadcast_to(x[:, self.at("filter_time_s"), None], ln_p.shape)
        logs = np.stack([log_velocity, log_acceleration, log_filter])
        stepped = np.repeat(logs[None], 4, axis=0)
        for entry in range(3):
            stepped[entry + 1, entry] += _STEP
        found = self._durations(*np.exp(stepped.swapaxes(0, 1)))
        after = (found[1:] - found[0]) / _STEP
        jacobian = after[0][..., None] * along_v[:, motion] + after[1][..., None] * along_a[:, motion]
        jacobian[..., self.at("filter_time_s")] += after[2]
        jacobian[..., self.at("dead_time_s")] += 1.0
        if self.exponent is None:
            jacobian[..., self.at("exponent")] += after[1] * ln_p
        return found[0] + x[:, self.at("dead_time_s"), None], jacobian

    def _durations(self, velocity: Array, acceleration: Array, filter_time_s: Array) -> Array:
        peak = reached_velocity(velocity, acceleration, filter_time_s, self.cruise_share)
        return duration_at_peak_s(peak * (1.0 - 1e-12), acceleration, filter_time_s)

    def clipped(self, x: Array) -> Array:
        """Entries, shape (B, P), within what they can be."""
        result = x.copy()
        if self.exponent is None:
            result[:, self.at("exponent")] = np.clip(result[:, self.at("exponent")], 0.0, MOST_EXPONENT)
        place = self.at("filter_time_s")
        result[:, place] = np.maximum(result[:, place], np.log(_LEAST_FILTER_S))
        place = self.at("dead_time_s")
        result[:, place] = np.clip(result[:, place], -MOST_AHEAD_S, MOST_DEAD_TIME_S)  # as robot files hold it
        return result

    def timing(self, x: Array, duration_error: float) -> ControllerTiming:
        """The controller of a vector, shape (P,), with the relative error of its durations."""
        accelerations = None if self.rule == "torque_limited" else np.exp(self.acceleration @ x)
        return ControllerTiming(
            rule=self.rule,
            velocity_rad_s=self.velocities(x),
            acceleration_rad_s2=accelerations,
            acceleration_factor=float(np.exp(x[self.at("acceleration_factor")])) if accelerations is None else 1.0,
            acceleration_exponent=float(x[self.at("exponent")]) if self.exponent is None else self.exponent,
            filter_time_s=float(np.exp(x[self.at("filter_time_s")])),
            dead_time_s=float(x[self.at("dead_time_s")]),
            least_cruise_share=self.cruise_share,
            duration_error=duration_error,
        )

    def velocities(self, x: Array) -> Array:
        """Joint velocity limits of a vector, shape (n,). [rad/s]"""
        return np.asarray(np.exp(self.velocity @ x))


def _least(slopes: Array, offset: Array, x: Array) -> tuple[Array, Array]:
    """Least expression of each motion (B, M), and its derivatives after the entries (B, M, P)."""
    values = (x @ slopes.T)[:, None, :] + offset
    least = values.argmin(axis=2)
    return np.take_along_axis(values, least[..., None], axis=2)[..., 0], slopes[least]


def candidates(paths: MotionPaths, exponents: tuple[float | None, ...] = (0.0, 1.0, None)) -> list[Candidate]:
    """All rules for some motions of a robot, the entry's own timing last.

    Args:
        paths: The motions, each of some length, of the nominal robot by the nominal controller.
        exponents: Powers of the speed limit; None: free.
    """
    robot = paths.timing.robot
    slopes = -np.log(np.maximum(paths.path.steepest_rad, 1e-12))
    nominal = paths.timing.full_speed[1]
    nominal_a, ramp = np.log(nominal), float(np.median(paths.timing.full_velocity / nominal))
    filter_time = float(np.log(robot.drives.filter_time_s))
    share = robot.drives.least_cruise_share
    result = []
    for exponent in exponents:
        shared: list[_Entry] = [("filter_time_s", filter_time, FILTER_SPREAD), ("dead_time_s", 0.0, DEAD_TIME_SPREAD_S)]
        if exponent is None:
            shared.append(("exponent", MIDDLE_EXPONENT, EXPONENT_SPREAD))
        velocity: list[_Entry] = [("velocity", 0.0, VELOCITY_SPREAD)]
        velocity += [(f"velocity.{name}", np.log(v), JOINT_VELOCITY_SPREAD) for name, v in _limits(robot)]
        factor: list[_Entry] = [("acceleration_factor", 0.0, FACTOR_SPREAD)]
        joints: list[_Entry] = [
            (f"acceleration.{name}", np.log(v / ramp), JOINT_ACCELERATION_SPREAD) for name, v in _limits(robot)
        ]
        typical = float(np.median(robot.velocity_rad_s))
        leading: list[_Entry] = [
            ("velocity", np.log(typical), LEADING_AXIS_SPREAD),
            ("acceleration", np.log(typical / ramp), LEADING_AXIS_SPREAD),
        ]
        names = robot.joint_names
        for rule, entries, v_names, a_names, offset, cruise in (
            (
                "torque_limited",
                [*velocity, *factor],
                [["velocity", f"velocity.{j}"] for j in names],
                [["acceleration_factor"]],
                nominal_a[:, None],
                share,
            ),
            (
                "joint_accelerations",
                [*velocity, *joints],
                [["velocity", f"velocity.{j}"] for j in names],
                [[f"acceleration.{j}"] for j in names],
                slopes,
                0.0,
            ),
            ("leading_axis", leading, [["velocity"]] * len(names), [["acceleration"]] * len(names), slopes, 0.0),
        ):
            table = [*entries, *shared]
            order = tuple(name for name, _, _ in table)
            result.append(
                Candidate(
                    rule=rule,  # type: ignore[arg-type]
                    exponent=exponent,
                    names=order,
                    mean=np.array([mean for _, mean, _ in table]),
                    spread=np.array([spread for _, _, spread in table]),
                    velocity=_ones(v_names, order),
                    velocity_offset=slopes,
                    acceleration=_ones(a_names, order),
                    acceleration_offset=offset,
                    cruise_share=cruise,
                )
            )
    return [*result, _own(paths)]


def _own(paths: MotionPaths) -> Candidate:
    """The entry's own timing: machines may be as their entry says, and few runs do not outweigh that."""
    robot, slopes = paths.timing.robot, -np.log(np.maximum(paths.path.steepest_rad, 1e-12))
    known = robot.controller or ControllerTiming(
        "torque_limited",
        robot.velocity_rad_s,
        None,
        robot.drives.filter_time_s,
        least_cruise_share=robot.drives.least_cruise_share,
    )
    v_names, a_names, offset = [f"velocity.{name}" for name in robot.joint_names], ["acceleration_factor"], slopes
    if known.acceleration_rad_s2 is None:
        accelerations, offset = np.array([known.acceleration_factor]), np.log(paths.timing.full_speed[1])[:, None]
    else:
        accelerations, a_names = known.acceleration_rad_s2, [f"acceleration.{name}" for name in robot.joint_names]
    order = (*v_names, *a_names, "filter_time_s", "dead_time_s")
    figures = np.log([*known.velocity_rad_s, *accelerations, known.filter_time_s])
    return Candidate(
        rule=known.rule,
        exponent=known.acceleration_exponent,
        names=order,
        mean=np.append(figures, known.dead_time_s),
        spread=np.full(len(order), _NO_SPREAD),
        velocity=_ones([[name] for name in v_names], order),
        velocity_offset=slopes,
        acceleration=_ones([[name] for name in a_names], order),
        acceleration_offset=offset,
        cruise_share=known.least_cruise_share,
        is_own=True,
    )


_Entry = tuple[str, float, float]


def _limits(robot: Robot) -> list[tuple[str, float]]:
    return list(zip(robot.joint_names, robot.velocity_rad_s.tolist(), strict=True))


def _ones(rows: list[list[str]], order: tuple[str, ...]) -> Array:
    """Ones where a row names an entry, shape (rows, P)."""
    return np.array([[float(name in row) for name in order] for row in rows])
