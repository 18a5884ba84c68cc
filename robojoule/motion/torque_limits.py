"""Torque limits of path motions: which path acceleration a peak velocity leaves.

A joint at a path node limits the path acceleration a at peak path velocity v by

    inertia a + max(|standing|, |standing + viscous v + centrifugal v^2|) <= usable ,

standing being gravity and Coulomb friction. Where less than `floor` would be left for `inertia a`, the controller goes
on up to `peak`: what is left falls to zero there without a step. A motion has a limit for every
joint and node; only few of them can be the tightest one at some velocity of interest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array

NEVER_BINDS = 1e-300  # inertia of a limit whose acceleration is beyond all others [Nm s2]


@dataclass(frozen=True)
class TorqueLimits:
    """K torque limits of each of M motions; all arrays have shape (M, K).

    Attributes:
        inertia: Torque per path acceleration, not negative. [Nm s2]
        standing: Torque at standstill. [Nm]
        viscous: Torque per path velocity. [Nm s]
        centrifugal: Torque per squared path velocity. [Nm s2]
        peak: Largest torque that the drive has. [Nm]
        usable: Largest torque that acceleration may use. [Nm]
        floor: Torque left for acceleration beyond the usable one, as far as the peak allows. [Nm]
    """

    inertia: Array
    standing: Array
    viscous: Array
    centrifugal: Array
    peak: Array
    usable: Array
    floor: Array

    @classmethod
    def joined(cls, parts: Sequence[TorqueLimits]) -> TorqueLimits:
        """Limits of the motions of all parts, one after the other, filled up with limits that never bind."""
        motions, width = sum(len(part.inertia) for part in parts), max(part.inertia.shape[1] for part in parts)
        whole = cls._fillings((motions, width))
        first = 0
        for part in parts:
            count, own = part.inertia.shape
            for field in fields(cls):
                getattr(whole, field.name)[first : first + count, :own] = getattr(part, field.name)
            first += count
        return whole

    @classmethod
    def _fillings(cls, shape: tuple[int, int]) -> TorqueLimits:
        """Limits that never bind."""
        values = {"inertia": NEVER_BINDS, "peak": 1.0, "usable": 1.0}
        return cls(*(np.full(shape, values.get(field.name, 0.0)) for field in fields(cls)))

    def of(self, rows: NDArray[np.intp]) -> TorqueLimits:
        """Limits of some motions."""
        return TorqueLimits(*(getattr(self, field.name)[rows] for field in fields(self)))

    def acceleration(self, velocity: Array) -> Array:
        """Path acceleration that all limits of a motion allow at a peak velocity, shape (M,). [1/s2]"""
        v = velocity[:, None]
        moving = self.centrifugal * v
        moving += self.viscous
        moving *= v
        moving += self.standing
        np.abs(moving, out=moving)
        return np.asarray(self._left(np.maximum(moving, np.abs(self.standing), out=moving)).min(axis=1))

    def steady_bounds(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bounds of the torque of steady motion between two velocities, shapes (M,) [1/s] -> (M, K). [Nm]"""
        lowest, highest = self.standing.copy(), self.standing.copy()
        for factor, power in ((self.viscous, 1), (self.centrifugal, 2)):
            at_low, at_high = factor * (low**power)[:, None], factor * (high**power)[:, None]
            lowest += np.minimum(at_low, at_high)
            highest += np.maximum(at_low, at_high)
        return lowest, highest

    def binding(self, lowest: Array, highest: Array) -> TorqueLimits:
        """The limits that can be the tightest of their motion while steady torques keep bounds (M, K) [Nm].

        A limit whose least acceleration exceeds the largest that another one leaves never binds.
        """
        standing = np.abs(self.standing)
        most = self._left(np.maximum(np.maximum(lowest, -highest), standing))
        least = self._left(np.maximum(np.maximum(highest, -lowest), standing))
        return self._packed(least <= most.min(axis=1, keepdims=True))

    def _left(self, steady: Array) -> Array:
        """Path acceleration that steady torques leave, all of shape (M, K). [1/s2]"""
        beyond = np.clip(self.peak - steady, 0.0, self.floor)
        np.subtract(self.usable, steady, out=steady)
        np.maximum(steady, beyond, out=steady)
        steady /= self.inertia
        return steady

    def _packed(self, chosen: NDArray[np.bool_]) -> TorqueLimits:
        """Chosen limits side by side, filled up with limits that never bind."""
        flat = np.flatnonzero(chosen)
        motion = flat // chosen.shape[1]
        counts = np.bincount(motion, minlength=len(chosen))
        place = np.arange(len(motion)) - (np.cumsum(counts) - counts)[motion]
        packed = self._fillings((len(chosen), max(int(counts.max(initial=0)), 1)))
        for field in fields(self):
            getattr(packed, field.name)[motion, place] = getattr(self, field.name).ravel()[flat]
        return packed
