"""Zones of vendors' motions as those of operation trees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from robojoule.formats.vendor.poses import Poses
from robojoule.formats.vendor.speed_limits import Execution
from robojoule.formats.vendor.trace import Event, Motion
from robojoule.programs.operation_tree import (
    CoarseZone,
    MoveOperation,
    UnknownOperation,
    WaitOperation,
)
from robojoule.robots.rigid_body import Placement

LEAST_RADIUS_M = 1e-6
RADIUS_PER_SHARE_M = 0.1  # what stands for a share of the way while no robot is known; nothing is computed with it
Step = MoveOperation | WaitOperation | UnknownOperation


def zone_of(execution: Execution, following: Event | None, poses: Poses | None) -> CoarseZone | Literal["fine"]:
    """The zone in which the next motion may begin; where something else follows, the controller stops.

    A share of the half way counts as the distance of the tool's place there from the target.
    """
    blend, motion = execution.motion.blend, execution.motion
    if blend is None or not isinstance(following, Motion):
        return "fine"
    if blend.radius_m is not None:
        radius_m = blend.radius_m
    elif poses is None:
        radius_m = (blend.share or 0.0) * RADIUS_PER_SHARE_M
    else:
        middle = tuple(0.5 * (a + b) for a, b in zip(execution.start_rad, execution.target_rad, strict=True))
        tool = motion.tool or Placement.identity()
        half, end = (poses.flange(position).at(tool.origin_m) for position in (middle, execution.target_rad))
        radius_m = (blend.share or 0.0) * float(np.linalg.norm(end - half))
    return CoarseZone(radius_m=radius_m) if radius_m > LEAST_RADIUS_M else "fine"


def with_ends(operations: Sequence[Step]) -> tuple[Step, ...]:
    """Operations among which a motion that no other one follows at once ends at its target, whatever its zone."""
    ends = [not isinstance(after, MoveOperation) for after in (*operations[1:], None)]
    return tuple(
        one.model_copy(update={"zone": "fine"}) if is_end and isinstance(one, MoveOperation) else one
        for one, is_end in zip(operations, ends, strict=True)
    )
