"""Motions made of others: some of them at one speed limit, or with payloads that differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index, Mask
from robojoule.motion.inverse import limits_for
from robojoule.motion.motions import Motions, MovedMotions, PowerSamples
from robojoule.motion.simulation import MotionRuns

_LARGEST = ("peak_power_w", "peak_torque_ratio")


def summed_runs(runs: Sequence[MotionRuns], owner: Index, count: int) -> dict[str, Array]:
    """Runs of N parts as those of motions that they make up: sums, and the largest of peaks.

    Args:
        runs: Runs of the parts, one set after the other.
        owner: Motion that each part belongs to, shape (N,).
        count: Number of motions.

    Returns:
        The fields of `MotionRuns` by their names, but for the speed limit.
    """
    found = {}
    for field in fields(MotionRuns):
        if field.name == "speed_limit":
            continue
        values = np.concatenate([getattr(one, field.name) for one in runs])
        total = np.zeros((count, *values.shape[1:]))
        (np.maximum if field.name in _LARGEST else np.add).at(total, owner, values)
        found[field.name] = total
    return found


class TiedMotions:
    """Motions of which some run at one speed limit, as those of a loop or of a subprogram that is called twice.

    In a cycle of one robot sums matter only. So the first of them counts for all, with the sum of their durations and
    energies, and the others count as motions of zero length.

    Args:
        parts: The motions as they run.
        owner: Motion that each of them counts for, shape (N,); itself where it is not tied.
        place: Part whose ends each motion has, shape (M,); all parts in order if not given.
        own_range: Lowest and highest speed limit that each of them takes, each of shape (N,); any if not given. [-]
    """

    def __init__(
        self,
        parts: Motions,
        owner: Index,
        place: Index | None = None,
        own_range: tuple[Array, Array] | None = None,
    ) -> None:
        self.parts, self.owner = parts, owner
        self.own_range = (np.zeros(len(owner)), np.ones(len(owner))) if own_range is None else own_range
        self.place = np.arange(parts.motions) if place is None else place

    @property
    def motions(self) -> int:
        """Number M of motions."""
        return len(self.place)

    @property
    def moving(self) -> Mask:
        """Whether each counts as moving, shape (M,)."""
        found = np.zeros(self.motions, dtype=np.bool_)
        np.logical_or.at(found, self.owner, self.parts.moving)
        return found

    @property
    def standing_torque_nm(self) -> tuple[Array, Array]:
        """Gravity torques at start and end, each of shape (M, n). [Nm]"""
        start, end = self.parts.standing_torque_nm
        return start[self.place], end[self.place]

    @property
    def idle_power_start_w(self) -> Array:
        """Idle power at the start of each motion, shape (M,). [W]"""
        return np.asarray(self.parts.idle_power_start_w[self.place])

    @property
    def idle_power_end_w(self) -> Array:
        """Idle power at the end of each motion, shape (M,). [W]"""
        return np.asarray(self.parts.idle_power_end_w[self.place])

    def _of_parts(self, speed_limits: ArrayLike) -> Array:
        limits = np.asarray(speed_limits, dtype=float)
        of_parts = np.broadcast_to(limits, (self.motions, limits.shape[-1]))[self.owner]
        return np.clip(of_parts, *(bound[:, None] for bound in self.own_range))

    def durations(self, speed_limits: ArrayLike) -> Array:
        """Durations under speed limits, shape (M, S). [s]"""
        of_parts = self.parts.durations(self._of_parts(speed_limits))
        found = np.zeros((self.motions, of_parts.shape[1]))
        np.add.at(found, self.owner, of_parts)
        return found

    def minimum_durations(self) -> Array:
        """Durations at full speed, shape (M,). [s]"""
        return self.durations(np.ones(1))[:, 0]

    def fastest_speed_limits(self) -> Array:
        """Lowest speed limits that give the fastest runs, shape (M,). [-]"""
        found = np.zeros(self.motions)
        np.maximum.at(found, self.owner, self.parts.fastest_speed_limits())
        return np.where(self.moving, found, 1.0)

    def kinks(self) -> list[Array]:
        """See `robojoule.motion.motions.Motions`: those of the parts, and where each has its fastest run. [-]"""
        of_parts, ends = self.parts.kinks(), self.parts.fastest_speed_limits()
        found = []
        for motion in range(self.motions):
            own = np.flatnonzero((self.owner == motion) & self.parts.moving)
            several = [ends[own]] if own.size > 1 else []
            found.append(np.unique(np.concatenate([np.zeros(0), *several, *(of_parts[part] for part in own)])))
        return found

    def speed_limits_for_durations(self, durations_s: ArrayLike) -> Array:
        """Smallest speed limits that give at most the requested durations, shape (M,). [-]"""
        return limits_for(self.durations, durations_s, self.minimum_durations(), self.moving)

    def simulate(self, speed_limits: ArrayLike) -> MotionRuns:
        """Run every motion at speed limits, (S,) or (M, S)."""
        limits = np.asarray(speed_limits, dtype=float)
        runs = self.parts.simulate(self._of_parts(limits))
        own = np.broadcast_to(limits, (self.motions, limits.shape[-1])).copy()
        return MotionRuns(speed_limit=own, **summed_runs([runs], self.owner, self.motions))

    def subset(self, rows: Index | slice) -> TiedMotions:
        """Some of the motions that count, in the order given."""
        chosen = np.arange(self.motions)[rows]
        position = np.full(self.motions, -1)
        position[chosen] = np.arange(len(chosen))
        members = np.flatnonzero(position[self.owner] >= 0)
        place = np.searchsorted(members, self.place[chosen])
        own_range = self.own_range[0][members], self.own_range[1][members]
        return TiedMotions(self.parts.subset(members), position[self.owner[members]], place, own_range)


@dataclass(frozen=True)
class Load:
    """Motions with one payload among others.

    Attributes:
        rows: Which motions they are, rising, shape (M',).
        moves: Which moves these have, shape (K',).
        motions: Their physics.
    """

    rows: Index
    moves: Index
    motions: MovedMotions


class LoadedMotions:
    """Motions of one robot whose payload changes between them.

    At a stop the robot holds what it brought there until it goes on: its power before a motion is that after the motion
    before it.

    Args:
        loads: Motions by payload; each motion in one of them.
        before: Motion before each of them, shape (M,); itself where there is none.
    """

    def __init__(self, loads: Sequence[Load], before: Index) -> None:
        self.loads, self.before = tuple(loads), before

    @property
    def motions(self) -> int:
        """Number M of motions."""
        return len(self.before)

    def _joined(self, parts: Sequence[Array]) -> Array:
        """Values of all motions, of those of each payload (M', ...)."""
        found = np.zeros((self.motions, *parts[0].shape[1:]))
        for load, part in zip(self.loads, parts, strict=True):
            found[load.rows] = part
        return found

    @property
    def moving(self) -> Mask:
        """Whether each motion moves, shape (M,)."""
        return np.asarray(
            self._joined([load.motions.moving.astype(float) for load in self.loads]) > 0.0, dtype=np.bool_
        )

    @property
    def standing_torque_nm(self) -> tuple[Array, Array]:
        """Gravity torques at start and end, each of shape (M, n). [Nm]"""
        both = [load.motions.standing_torque_nm for load in self.loads]
        start, end = (self._joined([pair[k] for pair in both]) for k in (0, 1))
        alone = self.before == np.arange(self.motions)
        return np.where(alone[:, None], start, end[self.before]), end

    @property
    def idle_power_start_w(self) -> Array:
        """Idle power before each motion, shape (M,). [W]"""
        own = self._joined([load.motions.idle_power_start_w for load in self.loads])
        alone = self.before == np.arange(self.motions)
        return np.where(alone, own, self.idle_power_end_w[self.before])

    @property
    def idle_power_end_w(self) -> Array:
        """Idle power after each motion, shape (M,). [W]"""
        return self._joined([load.motions.idle_power_end_w for load in self.loads])

    def _limits(self, speed_limits: ArrayLike) -> Array:
        limits = np.asarray(speed_limits, dtype=float)
        return np.broadcast_to(limits, (self.motions, limits.shape[-1]))

    def durations(self, speed_limits: ArrayLike) -> Array:
        """Durations under speed limits, shape (M, S). [s]"""
        limits = self._limits(speed_limits)
        return self._joined([load.motions.durations(limits[load.rows]) for load in self.loads])

    def minimum_durations(self) -> Array:
        """Durations at full speed, shape (M,). [s]"""
        return self._joined([load.motions.minimum_durations() for load in self.loads])

    def fastest_speed_limits(self) -> Array:
        """Lowest speed limits that give the fastest runs, shape (M,). [-]"""
        return self._joined([load.motions.fastest_speed_limits() for load in self.loads])

    def kinks(self) -> list[Array]:
        """See `robojoule.motion.motions.Motions`. [-]"""
        found = [np.zeros(0)] * self.motions
        for load in self.loads:
            for row, kinks in zip(load.rows.tolist(), load.motions.kinks(), strict=True):
                found[row] = kinks
        return found

    def speed_limits_for_durations(self, durations_s: ArrayLike) -> Array:
        """Smallest speed limits that give at most the requested durations, shape (M,). [-]"""
        wanted = np.asarray(durations_s, dtype=float)
        return self._joined([load.motions.speed_limits_for_durations(wanted[load.rows]) for load in self.loads])

    def simulate(self, speed_limits: ArrayLike) -> MotionRuns:
        """Run every motion at speed limits, (S,) or (M, S)."""
        limits = self._limits(speed_limits)
        return self._runs([load.motions.simulate(limits[load.rows]) for load in self.loads])

    def simulate_moves(self, move_limits: Array) -> MotionRuns:
        """Run every motion with speed limits of its moves, shape (K, S)."""
        return self._runs([load.motions.simulate_moves(move_limits[load.moves]) for load in self.loads])

    def _runs(self, runs: Sequence[MotionRuns]) -> MotionRuns:
        names = [field.name for field in fields(MotionRuns)]
        return MotionRuns(**{name: self._joined([getattr(one, name) for one in runs]) for name in names})

    def power_samples(self, motion: int, move_limits: Array, rate_hz: float) -> PowerSamples:
        """Time series of one motion; see `MovedMotions.power_samples`."""
        load = next(one for one in self.loads if motion in one.rows)
        return load.motions.power_samples(int(np.flatnonzero(load.rows == motion)[0]), move_limits[load.moves], rate_hz)

    def subset(self, rows: Index | slice) -> LoadedMotions:
        """Some of the motions, in the order given, without the moves that they are made of.

        The power before each is that with its own payload.
        """
        chosen = np.arange(self.motions)[rows]
        loads = []
        for load in self.loads:
            at = np.flatnonzero(np.isin(chosen, load.rows))
            if at.size:
                place = np.searchsorted(load.rows, chosen[at])
                loads.append(Load(at, np.zeros(0, dtype=np.intp), load.motions.subset(place)))
        return LoadedMotions(loads, np.arange(len(chosen)))
