"""Runs of blended motions: chains of legs and corners from stop to stop, simulated piece by piece.

Every leg and every piece of a corner is a path of its own, with its own torque series, and has its part of the time law
(see `robojoule.motion.blend_timing`); energies add up, peaks are the largest. All that a single motion gives is given
for a chain.

A chain has one speed limit. Each of its moves takes it as far as its own range allows: no move is faster than it may
be, or slower.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index, Mask
from robojoule.errors import InputError
from robojoule.motion.blend_samples import BlendSamples, sampled
from robojoule.motion.blend_timing import BlendTiming, BlendVelocities
from robojoule.motion.corners import Chain, Corners
from robojoule.motion.groups import summed_runs
from robojoule.motion.inverse import limits_for
from robojoule.motion.simulation import OWN_ENGINES, Engines, MotionPaths, MotionRuns
from robojoule.motion.time_laws import PathLaw
from robojoule.robots.robot import Robot

_LEAST_LIMIT = 1e-5  # that counts as one where moves keep their own


class BlendedPaths:
    """Physics of M chains of one robot; see `robojoule.motion.motions.Motions`.

    Args:
        robot: Robot with its payload, as it is.
        chains: The chains, K moves (legs as given) in all.
        move_range: Lowest and highest speed limit of each move, each of shape (K,); any if not given. [-]
        controller: The controller's model of the robot, by which it plans; the robot itself if not given.
        engines: What computes inverse dynamics; time laws have a closed form.

    Raises:
        InputError: Gravity and friction take all that a joint has in the poses of a corner.
    """

    def __init__(
        self,
        robot: Robot,
        chains: Sequence[Chain],
        move_range: tuple[Array, Array] | None = None,
        controller: Robot | None = None,
        engines: Engines = OWN_ENGINES,
    ) -> None:
        planner = robot if controller is None else controller
        corners = Corners.of(planner, chains)
        legs = MotionPaths(robot, corners.start_rad, corners.end_rad, controller, engines)
        self._take(
            tuple(chains), move_range, corners, legs, MotionPaths.along(robot, corners.pieces, controller, engines)
        )

    def _take(
        self,
        chains: tuple[Chain, ...],
        move_range: tuple[Array, Array] | None,
        corners: Corners,
        legs: MotionPaths,
        pieces: MotionPaths,
    ) -> None:
        self.robot, self.chains = legs.robot, chains
        self.corners, self.legs, self.pieces = corners, legs, pieces
        counts = np.array([len(chain.points_rad) - 1 for chain in chains])
        moves = int(counts.sum())
        self.move_range = (np.zeros(moves), np.ones(moves)) if move_range is None else move_range
        self._single = np.repeat(counts == 1, counts)  # moves that are whole motions
        self._chain = np.repeat(np.arange(len(counts)), counts)
        self.timing = BlendTiming(legs.timing, corners, pieces.timing.torques)
        firsts = np.searchsorted(corners.chain, np.arange(len(counts)))
        self._ends = firsts, np.append(firsts[1:], len(corners.chain)) - 1

    @property
    def motions(self) -> int:
        """Number M of chains."""
        return len(self.chains)

    @property
    def moving(self) -> Mask:
        """Whether each chain moves at all, shape (M,)."""
        return np.asarray(np.logical_or.reduceat(self.legs.moving, self._ends[0]), dtype=np.bool_)

    @property
    def standing_torque_nm(self) -> tuple[Array, Array]:
        """Gravity torques at start and end, each of shape (M, n). [Nm]"""
        start, end = self.legs.standing_torque_nm
        return start[self._ends[0]], end[self._ends[1]]

    @property
    def idle_power_start_w(self) -> Array:
        """Idle power at the start of each chain, shape (M,). [W]"""
        return np.asarray(self.legs.idle_power_start_w[self._ends[0]])

    @property
    def idle_power_end_w(self) -> Array:
        """Idle power at the end of each chain, shape (M,). [W]"""
        return np.asarray(self.legs.idle_power_end_w[self._ends[1]])

    @property
    def straight(self) -> tuple[Index, MotionPaths]:
        """Chains of a single leg, and these legs as single motions."""
        alone = np.flatnonzero(self._ends[0] == self._ends[1])
        return alone, self.legs.subset(self._ends[0][alone])

    def subset(self, rows: Index | slice) -> BlendedPaths:
        """Some of the chains, in the order given."""
        chosen = np.arange(self.motions)[rows].tolist()
        moves, legs, pieces = (
            np.concatenate([np.flatnonzero(owner == chain) for chain in chosen])
            for owner in (self._chain, self.corners.chain, self.corners.chain[self.corners.before][self.corners.corner])
        )
        chains, bounds = [self.chains[k] for k in chosen], (self.move_range[0][moves], self.move_range[1][moves])
        corners = Corners.of(self.legs.timing.robot, chains, self.corners.half_lengths_s(chosen))
        part = BlendedPaths.__new__(BlendedPaths)
        part._take(tuple(chains), bounds, corners, self.legs.known(legs), self.pieces.known(pieces))
        part.legs.timing.take_full_speed(self.legs.timing, legs)
        part.timing.full_acceleration = self.timing.full_acceleration[legs]
        return part

    def move_limits(self, speed_limits: ArrayLike) -> Array:
        """Speed limits of the moves under those of their chains, (S,) or (M, S) -> (K, S). [-]

        Raises:
            InputError: A speed limit is not in (0, 1].
        """
        limits = np.asarray(speed_limits, dtype=float)
        if not np.all((limits > 0.0) & (limits <= 1.0)):
            raise InputError("a speed limit is out of range", allowed="above 0 and at most 1 (100 %)")
        of_moves = np.broadcast_to(limits, (self.motions, limits.shape[-1]))[self._chain]
        low, high = (bound[:, None] for bound in self.move_range)
        return np.where(self._single[:, None], of_moves, np.clip(of_moves, low, high))

    def durations(self, speed_limits: ArrayLike) -> Array:
        """Durations under speed limits of the chains, shape (M, S). [s]"""
        return self._durations(self.move_limits(speed_limits))

    def _durations(self, move_limits: Array) -> Array:
        limits = move_limits[self.corners.leg]
        result = self.timing.durations_s(self.timing.velocities(limits))
        result[self.moving] += self.legs.timing.dead_time_s
        # Chains of one leg by the very formula of single motions.
        alone = self._ends[0] == self._ends[1]
        result[alone] = self.legs.durations(limits)[self._ends[0][alone]]
        return result

    def minimum_durations(self) -> Array:
        """Durations at full speed, shape (M,). [s]"""
        return self.durations(np.ones(1))[:, 0]

    def fastest_speed_limits(self) -> Array:
        """Lowest speed limits that give the fastest runs, shape (M,); 1 for chains of zero length. [-]"""
        single = self.legs.timing.fastest_speed_limits()[self._ends[0]]
        alone = self._ends[0] == self._ends[1]
        if alone.all():
            return single
        return np.where(alone, single, self._saturating())

    def _saturating(self) -> Array:
        """Lowest speed limits at which no limit of a leg binds beyond what bounds the fastest run, shape (M,)."""
        low, high = (bound[self.corners.leg] for bound in self.move_range)
        if self.timing.timing.acceleration_share(np.array([0.5]))[0] < 1.0:
            return np.ones(self.motions)  # a higher limit always gives a higher acceleration
        peak = self.timing.velocities(high[:, None]).peak[:, 0]
        needed = np.divide(peak, self.timing.highest, out=np.ones_like(peak), where=self.timing.highest > 0.0)
        found = np.full(self.motions, _LEAST_LIMIT)
        np.maximum.at(found, self.corners.chain, np.where(needed > low, np.minimum(needed, 1.0), _LEAST_LIMIT))
        return np.where(self.moving, found, 1.0)

    def kinks(self) -> list[Array]:
        """See `robojoule.motion.motions.Motions`: where corners and legs saturate, or moves keep their own. [-]"""
        corners, highest = self.corners, self.timing.highest
        low, high = (bound[corners.leg] for bound in self.move_range)
        fastest = self.timing.velocities(high[:, None])
        peaks = np.divide(fastest.peak[:, 0], highest, out=np.ones_like(highest), where=highest > 0.0)
        caps = np.minimum(highest[corners.before], highest[corners.after])
        places = np.concatenate([peaks, low, high, fastest.corner[:, 0] / caps])
        chain = np.concatenate([corners.chain, corners.chain, corners.chain, corners.chain[corners.before]])
        inside = (places > 0.0) & (places < 1.0) & (self._ends[0] != self._ends[1])[chain]
        return [np.unique(places[inside & (chain == one)]) for one in range(self.motions)]

    def speed_limits_for_durations(self, durations_s: ArrayLike) -> Array:
        """Smallest speed limits that give at most the requested durations; see `PathTiming`. [-]"""
        return limits_for(self.durations, durations_s, self.minimum_durations(), self.moving)

    def simulate(self, speed_limits: ArrayLike) -> MotionRuns:
        """Run every chain at speed limits, (S,) or (M, S)."""
        limits = np.asarray(speed_limits, dtype=float)
        runs = self.simulate_moves(self.move_limits(limits))
        runs.speed_limit[:] = np.broadcast_to(limits, runs.speed_limit.shape)
        return runs

    def simulate_moves(self, move_limits: Array) -> MotionRuns:
        """Run every chain with speed limits of its moves, shape (K, S); the runs name the highest of each chain."""
        limits = move_limits[self.corners.leg]
        velocities = self.timing.velocities(limits)
        legs = self.legs.runs_by(limits, lambda rows: self.leg_laws(rows, limits, velocities))
        shape = len(self.corners.corner), limits.shape[1]
        pieces = self.pieces.runs_by(np.ones(shape), lambda rows: self.timing.piece_laws(velocities, rows))
        chain = np.append(self.corners.chain, self.corners.chain[self.corners.before][self.corners.corner])
        arrays = summed_runs([MotionRuns(**legs), MotionRuns(**pieces)], chain, self.motions)
        arrays["speed_limit"] = np.maximum.reduceat(move_limits, np.searchsorted(self._chain, np.arange(self.motions)))
        self._add_dead_time(arrays)
        return MotionRuns(**arrays)

    def power_samples(self, motion: int, move_limits: Array, rate_hz: float) -> BlendSamples:
        """Time series of one motion; see `robojoule.motion.motions.MovedMotions`."""
        return sampled(self, motion, move_limits, rate_hz)

    def leg_laws(self, rows: Index, limits: Array, velocities: BlendVelocities) -> PathLaw:
        """Laws of legs; those that are whole motions by the very formula of single ones."""
        law = self.timing.leg_laws(velocities, rows)
        alone = np.flatnonzero(np.isin(rows, self._ends[0][self._ends[0] == self._ends[1]]))
        if alone.size:
            at, timing = rows[alone], self.legs.timing
            single = self.legs.laws(timing.peak_velocities(limits)[at], at, timing.accelerations(limits)[at])
            for field in fields(PathLaw):
                getattr(law, field.name)[alone] = getattr(single, field.name)
        return law

    def _add_dead_time(self, arrays: dict[str, Array]) -> None:
        if self.legs.timing.dead_time_s == 0.0:
            return
        ends = self.legs.subset(self._ends[1])
        ends.moving = self.moving
        ends.add_dead_time(arrays)

    def points_rad(self, chain: int, step_rad: float) -> Array:
        """Configurations along a chain; see `Corners.points_rad`. [rad]"""
        return self.corners.points_rad(chain, step_rad)
