"""The controller's rule for blended motions: path velocities from stop to stop, over legs and corners.

Legs and corners are those of `robojoule.motion.corners`; velocities are shares of full speed there. A corner is passed
at a constant path velocity w. A leg is a jerk-limited ramp from the velocity of the corner before it to a peak
velocity, a cruise, and a ramp to the velocity of the next corner. The rule is that of single motions
(`robojoule.motion.controller`), leg by leg:

- a corner's velocity w keeps the speed limits of both legs and, at every node, |standing + viscous w + centrifugal w^2|
  within the torque that is usable, or the floor above standing torque where that leaves more; centrifugal torque here
  has the curvature of the corner, for the rotors, too;
- every leg has one acceleration, whatever the speed limits: what torques leave at standstill and at its peak velocity
  of full speed. That is the highest one at which the leg cruises for the least share c of its own duration, between
  the velocities of its corners. Where one ramp alone takes more, the faster corner has the peak;
- a pass from the start and one from the end lower the corners' velocities as far as the legs between them are too short
  to ramp from one to the other.

A motion of one leg has exactly the law of a single motion. As zones shrink, corners slow down towards a stop with the
root of their length, and the motion becomes a sequence of single ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robojoule.arrays import Array, Index, Mask
from robojoule.errors import InputError
from robojoule.motion.controller import PathTiming
from robojoule.motion.corners import Corners
from robojoule.motion.dynamics import PathTorques
from robojoule.motion.time_laws import PathLaw

_BISECTIONS = 50
_Acceleration = Callable[[Index, Array], Array]
_Reached = Callable[[Index, Array, Array], Array]


@dataclass(frozen=True, eq=False)
class BlendVelocities:
    """Path velocities of legs and corners at S speed limits, as shares of full speed.

    Attributes:
        corner: Velocity in each corner, shape (C, S).
        first: Velocity at the start of each leg, shape (L, S).
        peak: Peak velocity of each leg, shape (L, S).
        last: Velocity at its end, shape (L, S).
        acceleration: Acceleration of each leg, shape (L, S). [1/s]
    """

    corner: Array
    first: Array
    peak: Array
    last: Array
    acceleration: Array


class BlendTiming:
    """Velocities of legs and corners as the controller plans them with the model it has of the robot.

    Args:
        timing: Timing of the whole legs as single motions.
        corners: Legs and corners.
        torques: Torques along the pieces of the corners, by the controller's model.
    """

    def __init__(self, timing: PathTiming, corners: Corners, torques: PathTorques) -> None:
        self.timing, self.corners, self.torques = timing, corners, torques
        counts = np.bincount(corners.chain)
        self.blended = np.flatnonzero(counts[corners.chain] > 1)
        """Legs of motions of several legs."""
        self.straight_s = corners.length_s - corners.cuts_s.sum(axis=1)
        self._order = np.arange(len(corners.chain)) - np.searchsorted(corners.chain, corners.chain)
        self._corner_after = np.full(len(corners.chain), -1)
        self._corner_after[corners.before] = np.arange(len(corners.before))

    @cached_property
    def highest(self) -> Array:
        """Velocities of legs at full speed by the joints' velocity limits, shape (L,)."""
        velocity = np.where(self.timing.moving, self.timing.commanded_velocity, 0.0)
        return np.asarray(velocity * self.corners.length_s)

    @cached_property
    def corner_limits(self) -> Array:
        """Velocities up to which the torques of each corner keep within their limits, shape (C,).

        Raises:
            InputError: Gravity and friction take all that a joint has in a corner.
        """
        corners, robot, rows = self.corners, self.timing.robot, slice(None)
        pieces, drives = corners.pieces, robot.drives
        peak = robot.peak_effort_nm[:, None]
        _, centrifugal, gravity = np.split(self.torques.values, 3, axis=1)
        slope, bend = (f(rows, self.torques.values_s) for f in (pieces.slopes_rad, pieces.curvatures_rad))
        standing = gravity + drives.coulomb_nm[:, None] * np.sign(pieces.delta_rad)[:, :, None]
        viscous = drives.viscous_nm_s_per_rad[:, None] * slope
        centrifugal = centrifugal + drives.reflected_inertia_kg_m2[:, None] * bend
        usable = np.maximum(drives.torque_use * peak, np.abs(standing) + drives.torque_floor * peak)
        left = np.minimum(usable, peak)
        self._check_standing(standing, left)
        allowed = np.minimum(
            *(_first_root(sign * centrifugal, sign * viscous, left - sign * standing) for sign in (1.0, -1.0))
        )
        of_piece = allowed.min(axis=(1, 2), initial=np.inf) * 2.0 * corners.half_s[corners.corner] * corners.share
        limits = np.full(len(corners.half_s), np.inf)
        np.minimum.at(limits, corners.corner, of_piece)
        return limits

    def _check_standing(self, standing: Array, left: Array) -> None:
        beyond = np.argwhere(np.abs(standing) >= left)
        if beyond.size == 0:
            return
        piece, joint, node = (int(number) for number in beyond[0])
        robot, leg = self.timing.robot, int(self.corners.leg[self.corners.before[self.corners.corner[piece]]])
        raise InputError(
            f"{robot.joint_names[joint]} of {robot.name} cannot move the arm through the zone of motion {leg + 1}: "
            f"gravity and friction take {abs(float(standing[piece, joint, node])):.4g} Nm",
            allowed=f"less than its peak torque of {robot.peak_effort_nm[joint]:.4g} Nm; "
            "a lighter payload, another pose, or an allowed overload",
        )

    @cached_property
    def full_acceleration(self) -> Array:
        """Acceleration of each leg at full speed, shape (L,). [1/s]"""
        corners, timing, rows = self.corners, self.timing, self.blended
        found = timing.acceleration * np.where(timing.moving, corners.length_s, 1.0)
        if rows.size == 0:
            return found
        limits, factor = timing.torque_limits().of(rows), np.ones(len(found))
        place = np.zeros(len(found), dtype=np.intp)
        place[rows] = np.arange(rows.size)

        def acceleration(legs: Index, velocity: Array) -> Array:
            """What peak velocities leave, shape (L',). [1/s]"""
            factor[legs] = limits.of(place[legs]).acceleration(velocity / corners.length_s[legs])
            return np.asarray(timing.acceleration_for(factor)[legs] * corners.length_s[legs])

        def reached(legs: Index, start: Array, goal: Array) -> Array:
            return self._searched(legs, start[:, 0], goal[:, 0], acceleration)[:, None]

        ends = self._ends(self.highest[:, None], reached)
        first, last = (end[:, 0] for end in ends[1:])
        first, last, straight = first[rows], last[rows], self.straight_s[rows]
        low = np.maximum(first, last)
        high = np.maximum(self.highest[rows], low)
        whole = self._cruises(first, high, last, acceleration(rows, high), straight)
        top = high
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2.0
            cruises = self._cruises(first, middle, last, acceleration(rows, middle), straight)
            low, high = np.where(cruises, middle, low), np.where(cruises, high, middle)
        found[rows] = acceleration(rows, np.where(whole, top, low))
        return found

    def velocities(self, speed_limits: Array) -> BlendVelocities:
        """Velocities at speed limits of the legs, shape (L, S), fractions in (0, 1]."""
        top = speed_limits * self.highest[:, None]
        share = self.timing.acceleration_share(speed_limits)
        acceleration = self.full_acceleration[:, None] * share
        jerk_s, straight = self.timing.filter_time_s, self.straight_s[:, None]
        corner, first, last = self._ends(
            top, lambda legs, start, goal: _reached(start, goal, straight[legs], acceleration[legs], jerk_s)
        )
        low = np.maximum(first, last)
        peak = np.maximum(top, low)
        open_ = ~self._cruises(first, peak, last, acceleration, straight)
        high = np.where(open_, peak, low)
        for _ in range(_BISECTIONS if open_.any() else 0):
            middle = (low + high) / 2.0
            cruises = self._cruises(first, middle, last, acceleration, straight)
            low, high = np.where(cruises, middle, low), np.where(cruises, high, middle)
        return BlendVelocities(corner, first, np.where(open_, low, peak), last, acceleration)

    def _ends(self, top: Array, reached: _Reached) -> tuple[Array, Array, Array]:
        """Velocities of corners (C, S), and of legs at start and end (L, S), with legs of peak velocities up to `top`.

        Args:
            top: Shape (L, S).
            reached: From legs (L') with velocities at one end and those wanted at the other, each of shape (L', S), to
                what these can be, up to what is wanted.
        """
        corners = self.corners
        before, after = corners.before, corners.after
        corner = np.minimum(np.minimum(top[before], top[after]), self.corner_limits[:, None])
        first, last = np.zeros_like(top), np.zeros_like(top)
        first[after], last[before] = corner, corner
        most = int(self._order.max(initial=0))
        for order in range(most):  # forward: what legs reach from their start
            legs = np.flatnonzero((self._order == order) & (self._corner_after >= 0))
            last[legs] = reached(legs, first[legs], last[legs])
            first[legs + 1] = last[legs]
        for order in range(most, 0, -1):  # backward: what legs may start with, to end as they must
            legs = np.flatnonzero(self._order == order)
            first[legs] = reached(legs, last[legs], first[legs])
            last[legs - 1] = first[legs]
        return first[after], first, last

    def _searched(self, legs: Index, start: Array, goal: Array, acceleration: _Acceleration) -> Array:
        """Velocities that legs reach on their straight parts, where acceleration depends on them, shape (L',)."""
        straight, jerk_s = self.straight_s[legs], self.timing.filter_time_s

        def fits(velocity: Array) -> Mask:
            left = acceleration(legs, np.maximum(velocity, start))
            return np.asarray(_ramp_way_s(start, velocity, left, jerk_s) <= straight, dtype=np.bool_)

        enough = fits(goal) | (goal <= start)
        if enough.all():
            return goal
        low, high = np.minimum(start, goal), goal
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2.0
            within = fits(middle)
            low, high = np.where(within, middle, low), np.where(within, high, middle)
        return np.where(enough, goal, low)

    def _cruises(self, first: Array, peak: Array, last: Array, acceleration: Array, straight_s: Array) -> Mask:
        """Whether legs cruise for the least share of their duration, at velocities of one shape."""
        jerk_s, share = self.timing.filter_time_s, self.timing.least_cruise_share
        ramps = sum(_ramp_s(peak - end, acceleration, jerk_s) for end in (first, last))
        ways = sum(_ramp_way_s(end, peak, acceleration, jerk_s) for end in (first, last))
        return np.asarray((straight_s - ways) * (1.0 - share) >= share * peak * ramps, dtype=np.bool_)

    def durations_s(self, velocities: BlendVelocities) -> Array:
        """Durations of the motions, without dead time, shape (M, S). [s]"""
        corners, v = self.corners, velocities
        law = self.leg_laws(v, np.arange(len(corners.chain)))
        legs = law.duration_s.sum(axis=-1)
        total = np.zeros((int(corners.chain.max()) + 1, legs.shape[1]))
        np.add.at(total, corners.chain, np.where(self.timing.moving[:, None], legs, 0.0))
        np.add.at(total, corners.chain[corners.before], 2.0 * corners.half_s[:, None] / v.corner)
        return total

    def leg_laws(self, velocities: BlendVelocities, legs: Index) -> PathLaw:
        """Time laws of legs (L') in their own path coordinate, from 0 to 1 over the whole leg, arrays (L', S, 7)."""
        corners = self.corners
        length = np.where(corners.length_s > 0.0, corners.length_s, 1.0)[legs, None]
        first, peak, last, acceleration = (
            part[legs] / length
            for part in (velocities.first, velocities.peak, velocities.last, velocities.acceleration)
        )
        cuts = corners.cuts_s[legs] / length
        return _ramped_law(first, peak, last, acceleration, self.timing.filter_time_s, cuts[:, :1], 1.0 - cuts[:, 1:])

    def piece_laws(self, velocities: BlendVelocities, pieces: Index) -> PathLaw:
        """Time laws of pieces (P') of corners, from 0 to 1 over each piece, arrays (P', S, 7)."""
        corners = self.corners
        corner = corners.corner[pieces]
        length = 2.0 * corners.half_s[corner] * corners.share[pieces]
        velocity = velocities.corner[corner] / length[:, None]
        none, one = np.zeros_like(velocity), np.ones_like(velocity)
        return PathLaw(
            duration_s=np.stack([none, none, none, 1.0 / velocity, none, none, none], axis=-1),
            jerk=np.zeros((*velocity.shape, 7)),
            acceleration=np.zeros((*velocity.shape, 7)),
            velocity=np.repeat(velocity[..., None], 7, axis=-1),
            position=np.stack([none, none, none, none, one, one, one], axis=-1),
        )


def _first_root(square: Array, linear: Array, left: Array) -> Array:
    """Lowest v > 0 with square v^2 + linear v = left, left being positive; infinite where there is none."""
    root = np.sqrt(np.maximum(linear**2 + 4.0 * square * left, 0.0))
    below = linear + root
    has = (linear**2 + 4.0 * square * left >= 0.0) & (below > 0.0)
    return np.divide(2.0 * left, below, out=np.full_like(below, np.inf), where=has)


def _ramp_s(change: Array, acceleration: Array, jerk_s: float) -> Array:
    """Time of a ramp over a change of velocity with full jerk phases of a length. [s]"""
    full = change >= acceleration * jerk_s
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(
            full, change / acceleration + jerk_s, 2.0 * np.sqrt(np.maximum(change, 0.0) * jerk_s / acceleration)
        )


def _ramp_way_s(start: Array, end: Array, acceleration: Array, jerk_s: float) -> Array:
    """Way of a ramp between two velocities. [s]"""
    return np.asarray((start + end) / 2.0 * _ramp_s(np.abs(end - start), acceleration, jerk_s))


def _reached(start: Array, goal: Array, straight_s: Array, acceleration: Array, jerk_s: float) -> Array:
    """Velocities up to a goal that ramps reach from a start on straight parts; arrays of one shape.

    With the change D, the way is (2 start + D) (D / a + T) / 2 where D >= a T, else (2 start + D) sqrt(D T / a), whose
    root in sqrt(D) is that of a cubic without a square.
    """
    full = acceleration * jerk_s
    with np.errstate(divide="ignore", invalid="ignore"):
        linear = 2.0 * start + full
        rest = 2.0 * acceleration * straight_s - 2.0 * start * full
        long = 2.0 * rest / (linear + np.sqrt(np.maximum(linear**2 + 4.0 * rest, 0.0)))
        size = straight_s * np.sqrt(acceleration / jerk_s)
        root = np.sqrt(size**2 / 4.0 + (2.0 * start / 3.0) ** 3)
        y = np.cbrt(size / 2.0 + root) - np.cbrt(np.maximum(root - size / 2.0, 0.0))
        for _ in range(2):  # what cancels in the difference of the roots
            y -= np.nan_to_num((y**3 + 2.0 * start * y - size) / (3.0 * y**2 + 2.0 * start), posinf=0.0, neginf=0.0)
    change = np.where(long >= full, long, np.maximum(y, 0.0) ** 2)
    return np.where(goal <= start, goal, np.minimum(goal, start + change))


def _ramped_law(
    first: Array, peak: Array, last: Array, acceleration: Array, jerk_s: float, start: Array, end: Array
) -> PathLaw:
    """Laws from position `start` at velocity `first` to `end` at `last`, with a cruise at `peak` between two ramps."""
    jerk, none = acceleration / jerk_s, np.zeros_like(peak)
    parts = []
    for velocity in (first, last):
        change = peak - velocity
        full = change >= acceleration * jerk_s
        ramp = np.where(full, jerk_s, np.sqrt(np.maximum(change, 0.0) / jerk))
        plateau = np.where(full, change / acceleration - jerk_s, 0.0)
        top = jerk * ramp
        rise = top * ramp / 2.0
        one = ramp * (velocity + top * ramp / 6.0)
        two = one + plateau * (velocity + rise + top * plateau / 2.0)
        way = (velocity + peak) / 2.0 * (2.0 * ramp + plateau)
        parts.append((ramp, plateau, top, rise, one, two, way))
    (r0, p0, a0, rise0, one0, two0, way0), (r1, p1, a1, rise1, one1, two1, way1) = parts
    left = np.maximum(end - start - way0 - way1, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        cruise = np.where(left > 0.0, left / peak, 0.0)
    return PathLaw(
        duration_s=np.stack([r0, p0, r0, cruise, r1, p1, r1], axis=-1),
        jerk=np.stack([jerk, none, -jerk, none, -jerk, none, jerk], axis=-1),
        acceleration=np.stack([none, a0, a0, none, none, -a1, -a1], axis=-1),
        velocity=np.stack([first, first + rise0, peak - rise0, peak, peak, peak - rise1, last + rise1], axis=-1),
        position=np.stack(
            [none + start, start + one0, start + two0, start + way0, end - way1, end - two1, end - one1], axis=-1
        ),
    )
