"""What planning asks of motions, whatever they follow: single lines, blended paths, several runs at one speed limit."""

from __future__ import annotations

from typing import Protocol

from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index, Mask
from robojoule.motion.simulation import MotionRuns


class Motions(Protocol):
    """M motions from stop to stop for n joints, each at a speed limit of its own."""

    @property
    def motions(self) -> int:
        """Their number M."""

    @property
    def moving(self) -> Mask:
        """Whether each of them moves at all, shape (M,)."""

    @property
    def standing_torque_nm(self) -> tuple[Array, Array]:
        """Gravity torques at the start and at the end of each motion, each of shape (M, n). [Nm]"""

    @property
    def idle_power_start_w(self) -> Array:
        """Idle power at the start of each motion, shape (M,). [W]"""

    @property
    def idle_power_end_w(self) -> Array:
        """Idle power at the end of each motion, shape (M,). [W]"""

    def durations(self, speed_limits: ArrayLike) -> Array:
        """Durations at speed limits (S,) or (M, S), fractions in (0, 1], shape (M, S). [s]"""

    def minimum_durations(self) -> Array:
        """Durations at full speed, shape (M,). [s]"""

    def kinks(self) -> list[Array]:
        """Speed limits of each motion at which its law changes, as a leg or a corner has got as fast as it can be. [-]

        Energy over duration need not be smooth or convex there.
        """

    def fastest_speed_limits(self) -> Array:
        """Lowest speed limits that give the fastest runs, shape (M,); 1 for motions of zero length. [-]"""

    def speed_limits_for_durations(self, durations_s: ArrayLike) -> Array:
        """Smallest speed limits that give at most the requested durations (M,) [s], shape (M,). [-]"""

    def simulate(self, speed_limits: ArrayLike) -> MotionRuns:
        """Run every motion at speed limits, shapes as for `durations`."""

    def subset(self, rows: Index | slice) -> Motions:
        """Some of the motions, in the order given."""


class PowerSamples(Protocol):
    """Mains power of one run in time."""

    @property
    def time_s(self) -> Array:
        """Instants, shape (T,); the last is the end of the run. [s]"""

    @property
    def power_w(self) -> Array:
        """Mains power, shape (T,). [W]"""


class MovedMotions(Motions, Protocol):
    """Motions of which each is made of moves, K in all, with speed limits of their own."""

    def simulate_moves(self, move_limits: Array) -> MotionRuns:
        """Run every motion with speed limits of its moves, shape (K, S); runs name the highest of each motion."""

    def subset(self, rows: Index | slice) -> MovedMotions:
        """Some of the motions, in the order given."""

    def power_samples(self, motion: int, move_limits: Array, rate_hz: float) -> PowerSamples:
        """Time series of one motion with speed limits of all moves, shape (K,), at a fixed rate and at its end."""
