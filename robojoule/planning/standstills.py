"""Where a robot stands in its cycle, and which standby mode it may use there.

Waits after one motion and before the next are one standstill, and so are those at the end and at the start of a cycle
that closes. For a controller with standby modes the least energy of a standstill falls where a wait becomes long enough
for a mode: it is neither convex nor continuous. But only few decisions are open:

- each standstill is as long as the program requires, or just long enough for a mode (a time for an energy: an option);
- all that is left of the cycle is waited at one of them (an `Offer`), where a second costs the least.

No plan is better: within their modes, standstills cost a fixed power each, so time may go from one to the cheapest of
them until it is as short as its mode or the program allows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.robots.standby import StandbyMode, standing_energy_j


@dataclass(frozen=True)
class Offer:
    """A standstill at which all that is left of the cycle is waited.

    Attributes:
        place: Which standstill.
        option: Which of its options it must take, for what is left costs the power of that mode.
        power_w: What each second costs. [W]
    """

    place: int
    option: int
    power_w: float


@dataclass(frozen=True, eq=False)
class Standstills:
    """The J standstills of a cycle of V motions.

    Attributes:
        required_s: How long the robot must stand, shape (J,). [s]
        power_w: Power of holding motors, shape (J,). [W]
        times_s: Times of each standstill's options, the required one first, J arrays. [s]
        energies_j: Their energies. [J]
        powers_w: Their powers. [W]
        written: Motion (row) and side (0 before it, 1 after it) that gets further waits, shape (J, 2).
    """

    required_s: Array
    power_w: Array
    times_s: tuple[Array, ...]
    energies_j: tuple[Array, ...]
    powers_w: tuple[Array, ...]
    written: tuple[tuple[int, int], ...]

    def offers(self) -> list[Offer]:
        """Where what is left may be waited: where it costs the least as it is, and in every mode that needs more."""
        cheapest = int(np.argmin([powers[0] for powers in self.powers_w]))
        found = [Offer(cheapest, 0, float(self.powers_w[cheapest][0]))]
        for place, powers in enumerate(self.powers_w):
            found += [Offer(place, option, float(powers[option])) for option in range(1, powers.size)]
        return found


def standing(waits_s: Array, closed: bool) -> Array:
    """Waits before and after V motions, shape (V, 2), as standstills: before each motion, and at an open end. [s]"""
    before = waits_s[:, 0].copy()
    before[1:] += waits_s[:-1, 1]
    if closed:
        before[0] += waits_s[-1, 1]
        return before
    return np.append(before, waits_s[-1, 1])


def standstills_of(
    required_s: Array, idle_w: Array, modes: Sequence[StandbyMode], *, closed: bool, step_s: float
) -> Standstills:
    """The standstills of a cycle.

    Args:
        required_s: Waits that are required before and after each of V motions, shape (V, 2). [s]
        idle_w: Power of holding motors at its start and end, shape (V, 2). [W]
        modes: Standby modes of the controller.
        closed: Whether the cycle ends where it starts.
        step_s: Step of added waits: those for a mode are rounded up to it. [s]
    """
    times = standing(required_s, closed)
    powers = idle_w[:, 0].copy() if closed else np.append(idle_w[:, 0], idle_w[-1, 1])
    written = [(0, 0), *((v - 1, 1) for v in range(1, len(required_s)))]
    if not closed:
        written.append((len(required_s) - 1, 1))
    options: list[tuple[Array, Array, Array]] = []
    for time, power in zip(times.tolist(), powers.tolist(), strict=True):
        lasting = [time]
        for mode in modes:
            missing = mode.least_idle_s - time
            if missing > 0.0:
                lasting.append(time + np.ceil(missing / step_s - 1e-6) * step_s)
        each = np.array(lasting)
        energy = standing_energy_j(modes, power, each)
        rates = np.array([_rate(modes, power, one) for one in lasting])
        options.append((each, energy, rates))
    each_time, each_energy, each_rate = (tuple(column) for column in zip(*options, strict=True))
    return Standstills(times, powers, each_time, each_energy, each_rate, tuple(written))


def _rate(modes: Sequence[StandbyMode], power_w: float, time_s: float) -> float:
    """Power of a wait of some length in the mode that costs least. [W]"""
    return min([power_w, *(mode.power_w for mode in modes if mode.least_idle_s <= time_s + 1e-9)])
