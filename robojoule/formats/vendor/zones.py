"""Zones of vendors' motions as those of operation trees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from robojoule.formats.vendor.trace import Blend, Event, Motion
from robojoule.programs.operation_tree import (
    CoarseZone,
    MoveOperation,
    PayloadOperation,
    ShareZone,
    UnknownOperation,
    WaitOperation,
)

LEAST_RADIUS_M = 1e-6
ASSUMED_BLEND = Blend(share=1.0)  # of a motion whose program does not say how far its zone reaches; told
HALF_OF_A_PATH = 0.5  # what vendors count shares of: a corner takes half of a motion at most
Step = MoveOperation | WaitOperation | PayloadOperation | UnknownOperation


def zone_of(motion: Motion, following: Event | None) -> CoarseZone | ShareZone | Literal["fine"]:
    """The zone in which the next motion may begin; where something else follows, the controller stops."""
    blend = motion.blend
    if blend is None or not isinstance(following, Motion):
        return "fine"
    if blend.radius_m is not None:
        return CoarseZone(radius_m=blend.radius_m) if blend.radius_m > LEAST_RADIUS_M else "fine"
    return ShareZone(path_share=HALF_OF_A_PATH * min(blend.share, 1.0)) if blend.share else "fine"


def with_ends(operations: Sequence[Step]) -> tuple[Step, ...]:
    """Operations among which a motion that no other one follows at once ends at its target, whatever its zone."""
    ends = [not isinstance(after, MoveOperation) for after in (*operations[1:], None)]
    return tuple(
        one.model_copy(update={"zone": "fine"}) if is_end and isinstance(one, MoveOperation) else one
        for one, is_end in zip(operations, ends, strict=True)
    )
