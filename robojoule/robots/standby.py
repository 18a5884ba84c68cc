"""Standby of a controller: what a robot draws in waits that are long enough for its brakes, or to take its bus off.

A wait of t seconds draws, with power p of motors that hold the arm, power p_m and least idle time T_m of a mode,

    W(t) = min( p t, p_m t for every mode with T_m <= t ) .

A controller that does so by itself enters a mode as a wait begins; what entering and leaving it takes is part of p_m.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from robojoule.arrays import Array
from robojoule.documents import Document
from robojoule.inputs import LONGEST_S


@dataclass(frozen=True)
class StandbyMode:
    """A state in which motors hold nothing.

    Attributes:
        name: brakes, or bus off.
        power_w: Mains power in it, wherever the arm stands. [W]
        least_idle_s: Shortest wait in which the controller enters it. [s]
    """

    name: str
    power_w: float
    least_idle_s: float


class StandbyModeFile(Document):
    """A mode as robot files have it; see `StandbyMode`."""

    power_w: Annotated[float, Field(ge=0)]
    least_idle_s: Annotated[float, Field(ge=0, le=LONGEST_S)]


class StandbyFile(Document):
    """Section `standby` of a robot file."""

    brakes: StandbyModeFile | None = Field(default=None, description="Brakes hold the arm, motors are off.")
    bus_off: StandbyModeFile | None = Field(default=None, description="The DC bus is discharged, too.")

    @model_validator(mode="after")
    def _deeper_later(self) -> StandbyFile:
        if self.brakes is None and self.bus_off is None:
            raise ValueError("at least one of brakes and bus_off must be given")
        if self.brakes is not None and self.bus_off is not None:
            if self.bus_off.power_w > self.brakes.power_w:
                raise ValueError("bus_off.power_w is more than brakes.power_w")
            if self.bus_off.least_idle_s < self.brakes.least_idle_s:
                raise ValueError("bus_off.least_idle_s is less than brakes.least_idle_s")
        return self

    def modes(self) -> tuple[StandbyMode, ...]:
        """The modes, the deepest last."""
        given = (("brakes", self.brakes), ("bus off", self.bus_off))
        return tuple(StandbyMode(name, mode.power_w, mode.least_idle_s) for name, mode in given if mode is not None)


def standing_energy_j(modes: Sequence[StandbyMode], power_w: ArrayLike, time_s: ArrayLike) -> Array:
    """Least energy of waits.

    Args:
        modes: Modes of the controller; without any, motors hold.
        power_w: Power of holding motors, any shape. [W]
        time_s: Length of each wait, of the same shape; rounding does not keep a controller from a mode. [s]

    Returns:
        Energies of the same shape. [J]
    """
    time = np.asarray(time_s, dtype=float)
    energy = np.asarray(np.asarray(power_w, dtype=float) * time)
    for mode in modes:
        energy = np.where(time >= mode.least_idle_s - 1e-9, np.minimum(energy, mode.power_w * time), energy)
    return np.asarray(energy)
