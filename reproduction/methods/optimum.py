"""`optimum`: the least energy that a cycle can take, to within a small proven gap: what every method is held against.

Profiles are simulated densely to begin with and refined where plans are until the proven lower bound is near, so that
all that separates this method from `robojoule_simulated` is its effort.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from reproduction.methods.method import Variant
from reproduction.methods.robojoule_simulated import RobojouleSimulated

TARGET_GAP = 8e-5  # relative gap between plan and bound at which the refinement ends


@dataclass(frozen=True)
class Optimum(RobojouleSimulated):
    """Planning on densely simulated profiles."""

    relative_gap: float = TARGET_GAP
    variant: ClassVar[Variant] = Variant("optimum")
