"""Where the energy profiles of motions come from: one protocol for simulated, predicted and measured ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from robojoule.arrays import Array
from robojoule.profile.enclosure import Enclosure


class ProfileSource(Protocol):
    """Energy profiles and idle power of M motions, however they are known.

    Planning needs no more than this (`robojoule.planning.source_plans`). A source that encloses the true profiles has
    its plans proven against them; one whose enclosures are exact (`Enclosure.exact`) has them proven against what it
    believes.
    """

    @property
    def idle_start_w(self) -> Array:
        """Idle power at the start of each motion, shape (M,). [W]"""
        ...

    @property
    def idle_end_w(self) -> Array:
        """Idle power at the end of each motion, shape (M,). [W]"""
        ...

    def enclosure(self, motion: int) -> Enclosure:
        """What is known of the profile of a motion."""
        ...

    def refine_near(self, durations_s: Mapping[int, Array]) -> list[int]:
        """Learn more of profiles near given durations.

        Args:
            durations_s: Durations by motion. [s]

        Returns:
            Motions of whose profile more is known now; none where the source has no more to tell.
        """
        ...
