"""How a controller makes its time laws, where that was learnt on the machine instead of taken from its drives.

By the rule `torque_limited` path accelerations are those of `robojoule.motion.controller` times a factor; by
`joint_accelerations` every joint has a constant acceleration limit, whatever the load; by `leading_axis` all joints
have the same velocity and acceleration limits, as a UR program's `movej(q, a, v)` gives them. A speed limit p scales
the velocity limits by p and accelerations by p to the power of `acceleration_exponent`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, model_validator

from robojoule.documents import Document
from robojoule.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robojoule.arrays import Array

AccelerationRule = Literal["torque_limited", "joint_accelerations", "leading_axis"]
MOST_EXPONENT = 3.0
MOST_DEAD_TIME_S = 1.0
MOST_AHEAD_S = 0.1  # by which motions may take less than their time law: how ends are told apart from rest
_Limit = Annotated[float, Field(ge=1e-6, le=1e6)]


class JointTimingFile(Document):
    """Limits of one joint at full speed."""

    velocity_rad_s: _Limit = Field(description="Velocity limit. [rad/s]")
    acceleration_rad_s2: _Limit | None = Field(
        default=None, description="Acceleration limit; none where accelerations follow from torques. [rad/s2]"
    )


class ControllerFile(Document):
    """Timing of a controller; see the module's text."""

    provenance: str = Field(min_length=1, description="From which runs, and how well they are met.")
    rule: AccelerationRule
    acceleration_factor: _Limit = Field(default=1.0, description="Times the torque-limited acceleration. [-]")
    acceleration_exponent: Annotated[float, Field(ge=0, le=MOST_EXPONENT)] = 0.0
    filter_time_s: Annotated[float, Field(ge=1e-6, le=10)] = Field(description="Length of a jerk phase. [s]")
    dead_time_s: Annotated[float, Field(ge=-MOST_AHEAD_S, le=MOST_DEAD_TIME_S)] = Field(
        default=0.0, description="What every motion takes beyond its time law. [s]"
    )
    least_cruise_share: Annotated[float, Field(ge=0, lt=1)] = 0.0
    duration_error_percent: Annotated[float, Field(ge=0, le=100)] = Field(
        default=0.0, description="Standard deviation of the duration of a motion that was not measured. [%]"
    )
    joints: dict[str, JointTimingFile]

    @model_validator(mode="after")
    def _accelerations_as_the_rule_wants_them(self) -> ControllerFile:
        wanted = self.rule != "torque_limited"
        for name, joint in self.joints.items():
            if (joint.acceleration_rad_s2 is not None) != wanted:
                problem = "acceleration_rad_s2 is missing" if wanted else "accelerations follow from torques"
                allowed = "one for every joint" if wanted else "no acceleration_rad_s2 with rule torque_limited"
                raise InputError(problem, key=f"controller.joints.{name}", allowed=allowed)
        return self

    def timing(self, joint_names: Sequence[str]) -> ControllerTiming:
        """The figures as arrays, joints in the order given."""
        from robojoule.arrays import frozen  # late: listing robots needs no numpy

        joints = [self.joints[name] for name in joint_names]
        accelerations = [joint.acceleration_rad_s2 for joint in joints if joint.acceleration_rad_s2 is not None]
        return ControllerTiming(
            rule=self.rule,
            velocity_rad_s=frozen([joint.velocity_rad_s for joint in joints]),
            acceleration_rad_s2=frozen(accelerations) if accelerations else None,
            acceleration_factor=self.acceleration_factor,
            acceleration_exponent=self.acceleration_exponent,
            filter_time_s=self.filter_time_s,
            dead_time_s=self.dead_time_s,
            least_cruise_share=self.least_cruise_share,
            duration_error=self.duration_error_percent / 100.0,
        )


@dataclass(frozen=True, eq=False)
class ControllerTiming:
    """How a controller makes time laws.

    Attributes:
        rule: Where accelerations come from; see the module's text.
        velocity_rad_s: Velocity limits at full speed, shape (n,). [rad/s]
        acceleration_rad_s2: Acceleration limits at full speed, shape (n,); None where they follow from torques.
            [rad/s2]
        acceleration_factor: Times the torque-limited acceleration. [-]
        acceleration_exponent: Power of the speed limit that scales accelerations. [-]
        filter_time_s: Acceleration divided by jerk. [s]
        dead_time_s: What every motion takes beyond its time law. [s]
        least_cruise_share: Least share of a run's duration at constant velocity. [-]
        duration_error: Standard deviation of the duration of a motion that was not measured, relative. [-]
    """

    rule: AccelerationRule
    velocity_rad_s: Array
    acceleration_rad_s2: Array | None
    filter_time_s: float
    acceleration_factor: float = 1.0
    acceleration_exponent: float = 0.0
    dead_time_s: float = 0.0
    least_cruise_share: float = 0.0
    duration_error: float = 0.0

    def __post_init__(self) -> None:
        from robojoule.arrays import freeze  # late: listing robots needs no numpy

        freeze(self)
