"""How the pendant of a robot counts its joints, as robot files state it; see `robojoule.robots.pendant`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from pydantic import Field

from robojoule.documents import Document
from robojoule.errors import InputError

Angles = Literal["model", "pendant"]
ANGLES: tuple[Angles, ...] = ("model", "pendant")


class PendantJointFile(Document):
    """How the pendant counts one joint."""

    sense: Literal[1, -1] = 1
    zero_deg: float = Field(default=0.0, description="Angle of the model where the pendant shows 0. [deg]")
    add: list[str] = Field(default_factory=list, description="Joints whose pendant angles are to be added.")


class PendantFile(Document):
    """How the pendant counts; joints that are not named count as the model does."""

    note: str = Field(min_length=1, description="Where that is known from.")
    joints: dict[str, PendantJointFile] = Field(default_factory=dict)


def pendant_errors(pendant: PendantFile | None, moving: Sequence[str]) -> list[InputError]:
    """What is wrong with a mapping of a robot with these moving joints, in order from the base."""
    if pendant is None:
        return []
    known = ", ".join(moving)
    errors = []
    for name, joint in pendant.joints.items():
        for other in (name, *joint.add):
            if other not in moving:
                errors.append(InputError(f"there is no moving joint '{other}'", key="pendant.joints", allowed=known))
        if name in moving and any(other in moving and moving.index(other) >= moving.index(name) for other in joint.add):
            problem = f"'{name}' includes a joint that is not nearer to the base"
            errors.append(InputError(problem, key=f"pendant.joints.{name}.add", allowed="joints nearer to the base"))
    return errors
