"""Operations of an operation tree: groups, moves with their zones, waits, process steps and changes of payload."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, ConfigDict, Discriminator, Field, Strict, Tag, model_validator

from robojoule.documents import Document
from robojoule.errors import InputError
from robojoule.inputs import LONGEST_S
from robojoule.programs.degree_keys import accepts_degrees, from_degrees, requires_type
from robojoule.robots.robot import Payload

PLANNED = {  # what plans change in moves, with its defaults
    "speed_limit_percent": 100.0,
    "wait_before_s": 0.0,
    "wait_after_s": 0.0,
    "added_wait_before_s": 0.0,
    "added_wait_after_s": 0.0,
    "most_speed_percent": None,
}
LEAST_SPEED_PERCENT = 0.01  # no controller goes slower; below it durations have no bounds
MOST_POWER_W = 1e7  # of a process step: no tool on a flange draws more

# Strict: text and booleans are not numbers in these files; integers are.
Number = Annotated[float, Strict()]
Duration = Annotated[Number, Field(ge=0, le=LONGEST_S)]
SpeedLimit = Annotated[Number, Field(ge=LEAST_SPEED_PERCENT, le=100)]
Configuration = Annotated[tuple[Number, ...], Field(min_length=1)]
Point = tuple[Number, Number, Number]


def _printable(name: str) -> str:
    if not name.isprintable():
        raise ValueError("a name holds printable characters only")
    return name


Name = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^\S(.*\S)?$"), AfterValidator(_printable)]


class CoarseZone(Document):
    """The robot may round the corner anywhere within a radius of the target."""

    radius_m: Annotated[Number, Field(gt=0)] = Field(description="Radius of the zone round the target. [m]")


class ShareZone(Document):
    """The robot may round the corner over a share of the moves on both sides: for controllers without a radius."""

    path_share: Annotated[Number, Field(gt=0, le=0.5)] = Field(
        description="Share of the moves to and from the target that the corner may take. [-]"
    )


def _zone_kind(value: Any) -> str | None:
    if value == "fine":
        return "fine"
    if isinstance(value, ShareZone) or (isinstance(value, Mapping) and "path_share" in value):
        return "share"
    return "coarse" if isinstance(value, (Mapping, CoarseZone)) else None


Zone = Annotated[
    Annotated[Literal["fine"], Tag("fine")] | Annotated[CoarseZone, Tag("coarse")] | Annotated[ShareZone, Tag("share")],
    Discriminator(
        _zone_kind,
        custom_error_type="zone",
        custom_error_message="a zone is either the word fine or a mapping with radius_m or path_share",
    ),
]


class ToolPath(Document):
    """The way of the tool in space, in place of a straight line of joint angles; the tool turns evenly on it."""

    type: Literal["linear", "circular"] = Field(description="A straight line, or a circle.")
    tool_m: Point = Field(
        default=(0.0, 0.0, 0.0), description="Point of the tool that keeps to it, in the robot's tool frame. [m]"
    )
    via_m: Point | None = Field(
        default=None, description="Point in the robot's base frame that a circle passes, needed for circles. [m]"
    )
    acceleration_m_s2: Annotated[Number, Field(gt=0)] | None = Field(
        default=None, description="Largest acceleration of the point; none: what the torques leave. [m/s2]"
    )
    acceleration_rad_s2: Annotated[Number, Field(gt=0)] | None = Field(
        default=None, description="Largest acceleration of the tool's turn; none: what the torques leave. [rad/s2]"
    )

    @model_validator(mode="after")
    def _circles_pass_a_point(self) -> ToolPath:
        if (self.type == "circular") != (self.via_m is not None):
            raise ValueError("a circular path passes a point via_m, a linear one does not")
        return self


def _path_kind(value: Any) -> str | None:
    if isinstance(value, str) and value in ("joint", "linear"):
        return "word"
    return "tool" if isinstance(value, (Mapping, ToolPath)) else None


MovePath = Annotated[
    Annotated[Literal["joint", "linear"], Tag("word")] | Annotated[ToolPath, Tag("tool")],
    Discriminator(
        _path_kind,
        custom_error_type="path",
        custom_error_message="a path is the word joint or linear, or a mapping with type linear or circular",
    ),
]


class MoveOperation(Document):
    """Move to a joint configuration, with a stop there if the zone is fine: from point to point, or along a path."""

    model_config = ConfigDict(json_schema_extra=accepts_degrees("target"))

    type: Literal["move"] = "move"
    name: Name = Field(description="Name, unique in the tree.")
    target_rad: Configuration = Field(description="Joint configuration to reach, one value per joint. [rad]")
    zone: Zone = Field(
        default="fine",
        description="fine: stop at the target; radius_m: pass it within this distance; path_share: round the corner "
        "over this share of the moves on both sides.",
    )
    path: MovePath = Field(
        default="joint",
        description="joint: a straight line of joint angles; linear: a straight line of the flange; else that of a "
        "tool, which stops before and behind it.",
    )
    speed_limit_percent: SpeedLimit = Field(
        default=100.0, description="Share of the joint velocity limits that may be used; plans keep below it. [%]"
    )
    least_speed_percent: SpeedLimit | None = Field(
        default=None, description="Lowest speed limit that a plan may set; none: as low as plans go. [%]"
    )
    most_speed_percent: SpeedLimit | None = Field(
        default=None,
        description="The program's own speed limit where a plan stands in its place, written by plans: adjusted plans "
        "keep below it; none: full speed. [%]",
    )
    fixed: Annotated[bool, Strict()] = Field(default=False, description="Whether plans keep the speed limit as it is.")
    speed_group: Name | None = Field(
        default=None,
        description="Moves of one group have one speed limit, like a line that runs several times; none: its own.",
    )
    wait_before_s: Duration = Field(default=0.0, description="Wait at the start of the move. [s]")
    wait_after_s: Duration = Field(default=0.0, description="Wait at the target. [s]")
    added_wait_before_s: Duration = Field(
        default=0.0, description="Further wait at the start, added by a plan; the next plan may take it away. [s]"
    )
    added_wait_after_s: Duration = Field(
        default=0.0, description="Further wait at the target, added by a plan; the next plan may take it away. [s]"
    )

    @model_validator(mode="before")
    @classmethod
    def _degrees(cls, data: Any) -> Any:
        return from_degrees(data, "target")

    @model_validator(mode="after")
    def _speeds_in_order(self) -> MoveOperation:
        least = self.least_speed_percent
        if least is not None and least > self.speed_limit_percent:
            raise ValueError(
                f"least_speed_percent is {least:g}, more than the speed limit of {self.speed_limit_percent:g} %"
            )
        return self

    @property
    def all_before_s(self) -> float:
        """Wait at the start of the move, with what a plan added. [s]"""
        return self.wait_before_s + self.added_wait_before_s

    @property
    def all_after_s(self) -> float:
        """Wait at the target, with what a plan added. [s]"""
        return self.wait_after_s + self.added_wait_after_s

    @property
    def is_fine(self) -> bool:
        """Whether the robot stops at the target."""
        return self.zone == "fine"

    @property
    def tool_path(self) -> ToolPath | None:
        """The way of the tool; None: a straight line of joint angles."""
        if isinstance(self.path, ToolPath):
            return self.path
        return ToolPath(type="linear") if self.path == "linear" else None


class WaitOperation(Document):
    """The robot stands still for a fixed time."""

    model_config = ConfigDict(json_schema_extra=requires_type)

    type: Literal["wait"] = "wait"
    name: Name = Field(description="Name, unique in the tree.")
    duration_s: Duration = Field(description="How long. [s]")


class ProcessOperation(Document):
    """A process step (weld, screw, grip) at which the robot stands still."""

    model_config = ConfigDict(json_schema_extra=requires_type)

    type: Literal["process"] = "process"
    name: Name = Field(description="Name, unique in the tree.")
    duration_s: Duration = Field(description="How long. [s]")
    power_w: Annotated[Number, Field(ge=0, le=MOST_POWER_W)] = Field(
        default=0.0, description="Electrical power of the process beside that of the standing robot. [W]"
    )


class PayloadOperation(Document):
    """What the robot carries from here on; before the first one it carries what it was given."""

    model_config = ConfigDict(json_schema_extra=requires_type)

    type: Literal["payload"] = "payload"
    name: Name = Field(description="Name, unique in the tree.")
    mass_kg: Annotated[Number, Field(ge=0)] = Field(description="Mass, all that hangs on the flange. [kg]")
    com_m: Point = Field(default=Payload().com_m, description="Centre of mass in the tool frame. [m]")
    inertia_kg_m2: Annotated[tuple[Number, ...], Field(min_length=3, max_length=6)] | None = Field(
        default=None,
        description="Inertia about the centre of mass in tool axes: xx, yy, zz, or these and xy, xz, yz; none: that of "
        "a solid aluminium sphere. [kg m2]",
    )

    @model_validator(mode="after")
    def _is_a_body(self) -> PayloadOperation:
        try:
            self.payload()
        except InputError as error:
            raise ValueError(str(error.problem)) from None
        return self

    @property
    def duration_s(self) -> float:
        """It takes no time. [s]"""
        return 0.0

    def payload(self) -> Payload:
        """The same as robots take it."""
        return Payload(self.mass_kg, self.com_m, self.inertia_kg_m2)


class UnknownOperation(Document):
    """Something whose length is not known: a wait for a signal, or motions that nobody but the controller knows.

    It splits the cycle into sections, which are planned one by one (`sections_of`).
    """

    model_config = ConfigDict(json_schema_extra=accepts_degrees("target", optional=True))

    type: Literal["unknown"] = "unknown"
    name: Name = Field(description="Name, unique in the tree.")
    target_rad: Configuration | None = Field(
        default=None, description="Where the robot stands afterwards; none: where it was. [rad]"
    )

    @model_validator(mode="before")
    @classmethod
    def _degrees(cls, data: Any) -> Any:
        return from_degrees(data, "target", optional=True)

    @property
    def duration_s(self) -> float:
        """Nobody knows how long it takes.

        Raises:
            InputError: Always: what needs the figure cannot be done with the whole cycle.
        """
        problem = f"nobody knows how long operation '{self.name}' takes"
        raise InputError(problem, allowed="a program whose operations all have their durations")


class CompoundOperation(Document):
    """A named group of operations, executed in order; it moves nothing itself."""

    model_config = ConfigDict(json_schema_extra=requires_type)

    type: Literal["compound"] = "compound"
    name: Name = Field(description="Name, unique in the tree.")
    operations: tuple[Operation, ...] = Field(min_length=1, description="Operations in order of execution.")


AtomicOperation = MoveOperation | WaitOperation | ProcessOperation | PayloadOperation | UnknownOperation
Operation = Annotated[CompoundOperation | AtomicOperation, Field(discriminator="type")]


CompoundOperation.model_rebuild()
