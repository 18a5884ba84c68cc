"""The robot file: kinematics, limits, link inertia, collision capsules and drives of one serial arm."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from robojoule.documents import Document
from robojoule.errors import InputError, refuse
from robojoule.inputs import counted, shown
from robojoule.robots.controller_file import ControllerFile
from robojoule.robots.drives import LEAST_CRUISE_SHARE
from robojoule.robots.pendant_file import PendantFile, pendant_errors
from robojoule.robots.standby import StandbyFile

Vector = tuple[float, float, float]
# What others are divided by: no figure of a machine is smaller, and below it results have no bounds.
LEAST_FIGURE = 1e-6
Positive = Annotated[float, Field(ge=LEAST_FIGURE)]
NonNegative = Annotated[float, Field(ge=0)]
JOINT_TYPES = ("revolute", "fixed")
FigureGroup = Literal[
    "kinematics", "limits", "effort", "peak_effort", "inertia", "capsules", "drives", "supply", "standby"
]
FigureKind = Literal["published", "composed", "fitted", "scaled", "identified", "stated", "assumed"]


class Provenance(Document):
    """Where a group of figures comes from.

    Kinds: published by the vendor or in the literature; composed from published figures of siblings; fitted on
    published totals; scaled from anchors by law; identified from measurements; stated by whoever wrote the file;
    assumed where nothing is known.
    """

    kind: FigureKind
    note: str = Field(min_length=1)


class InertiaTensor(Document):
    """Inertia about the centre of mass, in link axes. [kg m2]"""

    ixx: float
    ixy: float
    ixz: float
    iyy: float
    iyz: float
    izz: float


class LinkFile(Document):
    """Inertial figures of a link."""

    mass_kg: NonNegative
    com_m: Vector
    inertia_kg_m2: InertiaTensor


def of_joint(name: object) -> str:
    """Key of messages about a joint: its name, as its place in a list says little."""
    return f"joint '{name}'"


class JointFile(Document):
    """A joint between two links; fixed joints carry no limits."""

    name: str = Field(min_length=1)
    type: Literal["revolute", "fixed"]
    parent: str
    child: str
    origin_xyz_m: Vector
    origin_rpy_rad: Vector
    axis: Vector
    lower_rad: float | None = None
    upper_rad: float | None = None
    velocity_rad_s: Positive | None = None
    effort_nm: Positive | None = None
    peak_effort_nm: Positive | None = None

    @model_validator(mode="before")
    @classmethod
    def _check_what_is_written(cls, data: Any) -> Any:
        """Check type and limits before their own fields do, which know the joint's place in the list only."""
        if not isinstance(data, dict):
            return data
        name, kind = data.get("name"), data.get("type")
        if isinstance(kind, str) and kind not in JOINT_TYPES:
            raise InputError(f"the joint type '{kind}' is unknown", key=of_joint(name), allowed=", ".join(JOINT_TYPES))
        if kind == "revolute":
            refuse([InputError(p.problem, key=of_joint(name), allowed=p.allowed) for p in limit_problems(data)])
        return data

    @model_validator(mode="after")
    def _turns(self) -> JointFile:
        if self.type != "fixed" and not any(self.axis):
            raise InputError("the axis is zero", key=of_joint(self.name), allowed="a direction")
        return self


@dataclass(frozen=True)
class LimitProblem:
    """What is wrong with a limit of a joint, and figures that let the other checks go on."""

    key: str
    problem: str
    allowed: str
    stand_ins: dict[str, float | None]


def limit_problems(joint: Mapping[str, Any]) -> list[LimitProblem]:
    """What is wrong with the limits of a joint that turns, as plain data; what is not a number is left out."""
    found = [
        LimitProblem(key, f"{key} is missing", "a number", {key: stand_in})
        for key, stand_in in _STAND_INS.items()
        if joint.get(key) is None
    ]
    figures = {key: value for key in (*_STAND_INS, _PEAK) if (value := _figure(joint.get(key))) is not None}
    for key in ("velocity_rad_s", "effort_nm", _PEAK):
        if key in figures and not figures[key] >= LEAST_FIGURE:
            allowed = "above 0" if not figures[key] > 0 else f"{LEAST_FIGURE:g} or more"
            stand_ins = {key: _STAND_INS.get(key), _PEAK: None}
            found.append(LimitProblem(key, f"{key} is {shown(joint[key])}", allowed, stand_ins))
    lower, upper = (figures.get(key, math.nan) for key in ("lower_rad", "upper_rad"))
    if lower >= upper:
        problem = f"lower_rad {lower:g} is not below upper_rad {upper:g}"
        range_of = {key: _STAND_INS[key] for key in ("lower_rad", "upper_rad")}
        found.append(LimitProblem("upper_rad", problem, f"above {lower:g}", range_of))
    effort, peak = (figures.get(key, math.nan) for key in ("effort_nm", _PEAK))
    if 0.0 < peak < effort:
        problem = f"{_PEAK} {peak:g} is below effort_nm {effort:g}"
        found.append(LimitProblem(_PEAK, problem, f"{effort:g} or more", {_PEAK: None}))
    return found


_PEAK = "peak_effort_nm"
_STAND_INS: dict[str, float | None] = {"lower_rad": -1e6, "upper_rad": 1e6, "velocity_rad_s": 1.0, "effort_nm": 1.0}


def _figure(value: Any) -> float | None:
    return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else None


class CapsuleFile(Document):
    """A capsule around a part of a link, in link axes. [m]"""

    from_m: Vector
    to_m: Vector
    radius_m: Positive


class ToolFile(Document):
    """The tool frame on its parent link; its z axis leaves the flange."""

    parent: str
    origin_xyz_m: Vector
    origin_rpy_rad: Vector


class JointDriveFile(Document):
    """Drive of one joint; see `robojoule.robots.drives.DriveParameters`."""

    gear_ratio: Positive
    rotor_inertia_kg_m2: NonNegative
    coulomb_nm: NonNegative
    viscous_nm_s_per_rad: NonNegative
    copper_w_per_nm2: NonNegative


class SupplyFile(Document):
    """What lies between the mains and the bus of the arm; see `robojoule.robots.drives.Supply`."""

    controller_power_w: NonNegative
    efficiency: Annotated[float, Field(ge=LEAST_FIGURE, le=1)]


class DrivesFile(Document):
    """Drives and controller, seen from the mains; see `robojoule.robots.drives.DriveParameters`."""

    provenance: str = Field(min_length=1, description="published, fitted or scaled: from what and how.")
    base_power_w: NonNegative
    drive_active_power_w: NonNegative
    inverter_efficiency: Annotated[float, Field(ge=LEAST_FIGURE, le=1)]
    regeneration_efficiency: Annotated[float, Field(ge=0, le=1)]
    torque_use: Annotated[float, Field(ge=LEAST_FIGURE, le=1)]
    torque_floor: Annotated[float, Field(ge=LEAST_FIGURE, lt=1)]
    filter_time_s: Positive
    least_cruise_share: Annotated[float, Field(ge=0, lt=1)] = LEAST_CRUISE_SHARE
    supply: SupplyFile | None = Field(default=None, description="What of it lies before the arm, where that is known.")
    joints: dict[str, JointDriveFile]

    @model_validator(mode="after")
    def _supply_within_base(self) -> DrivesFile:
        if self.supply is not None and self.supply.controller_power_w > self.base_power_w:
            raise ValueError("supply.controller_power_w is more than base_power_w, of which it is a part")
        if self.supply is not None and self.supply.efficiency < self.inverter_efficiency:
            raise ValueError("supply.efficiency is less than inverter_efficiency, of which it is a factor")
        return self


class RobotFile(Document):
    """One serial arm with any number of joints.

    Each joint that moves carries a body: its child link and all links fixed to it. That body needs a mass and a
    positive definite inertia, unless its link is listed in `lumped_links`: link -> link nearer to the base whose
    figures hold its inertia, as some vendors publish wrists. `lumped_branches` names joints of a URDF that are held
    still as they are beside the arm, with their positions [rad or m].
    """

    name: str = Field(min_length=1)
    vendor: str
    model: str
    rated_payload_kg: NonNegative
    source: str
    license: str
    caveats: str = ""
    provenance: dict[FigureGroup, Provenance] = Field(default_factory=dict)
    root_link: str
    links: dict[str, LinkFile | None]
    lumped_links: dict[str, str] = Field(default_factory=dict)
    joints: list[JointFile] = Field(min_length=1)
    tool: ToolFile
    home_rad: list[float]
    capsules: dict[str, list[CapsuleFile]] = Field(default_factory=dict)
    drives: DrivesFile
    lumped_branches: dict[str, float] = Field(default_factory=dict)
    pendant: PendantFile | None = None
    controller: ControllerFile | None = Field(default=None, description="Its timing, where that was learnt.")
    standby: StandbyFile | None = Field(default=None, description="What it draws in long waits, where it has modes.")
    derived_from: str | None = Field(
        default=None, min_length=1, description="Name of the robot whose programs it takes too: what it was before."
    )

    @property
    def moving_joints(self) -> list[JointFile]:
        """The joints that move, from the base to the flange."""
        return [joint for joint in self.joints if joint.type != "fixed"]

    @property
    def total_mass_kg(self) -> float:
        """Mass of all links, the base included where its figures are given. [kg]"""
        return sum(link.mass_kg for link in self.links.values() if link is not None)

    @property
    def reach_m(self) -> float:
        """Distance along the kinematic chain from joint 2 (of a single joint: from it) to the tool frame. [m]"""
        above = {joint.child: joint for joint in self.joints}
        steps, link = [self.tool.origin_xyz_m], self.tool.parent
        second = self.moving_joints[:2][-1].name
        while (joint := above.get(link)) is not None and joint.name != second:
            steps.append(joint.origin_xyz_m)
            link = joint.parent
        return sum(math.hypot(*step) for step in reversed(steps))

    @property
    def installed_power_w(self) -> float:
        """Sum over the joints of effort limit times velocity limit: a measure of the drives' size. [W]"""
        return sum((joint.effort_nm or 0.0) * (joint.velocity_rad_s or 0.0) for joint in self.moving_joints)

    @model_validator(mode="after")
    def _consistent(self) -> RobotFile:
        """All that does not fit together; what hangs on names and joints is looked at once these are right."""
        refuse([*self._joint_errors(), *self._link_name_errors()])
        self._check_chain()
        for joint, value in zip(self.moving_joints, self.home_rad, strict=True):
            # Rounding of degrees to radians must not push a joint over its limit.
            if not joint.lower_rad - 1e-9 <= value <= joint.upper_rad + 1e-9:  # type: ignore[operator]
                raise InputError(
                    f"'{joint.name}' is at {value:g} rad, beyond its limits",
                    key="home_rad",
                    allowed=f"{joint.lower_rad:g} to {joint.upper_rad:g} rad",
                )
        return self

    def _joint_errors(self) -> Iterator[InputError]:
        names = [joint.name for joint in self.joints]
        if len(set(names)) != len(names):
            yield InputError("two joints have the same name", key="joints", allowed="unique names")
        known = ", ".join(self.links)
        for joint in self.joints:
            for link in (joint.parent, joint.child):
                if link not in self.links:
                    yield InputError(f"the link '{link}' is unknown", key=of_joint(joint.name), allowed=known)
        moving = [joint.name for joint in self.moving_joints]
        if not moving:
            yield InputError("the robot has no moving joint", key="joints", allowed="at least one")
        elif set(self.drives.joints) != set(moving):
            named = ", ".join(self.drives.joints) or "none"
            yield InputError(
                f"these are not the moving joints: {named}", key="drives.joints", allowed=f"exactly {', '.join(moving)}"
            )
        if self.controller is not None and set(self.controller.joints) != set(moving):
            named = ", ".join(self.controller.joints) or "none"
            problem = f"these are not the moving joints: {named}"
            yield InputError(problem, key="controller.joints", allowed=f"exactly {', '.join(moving)}")
        if len(self.home_rad) != len(moving):
            problem = f"{counted(len(self.home_rad), 'value')} given"
            yield InputError(problem, key="home_rad", allowed=f"{len(moving)} values, one per moving joint")
        yield from pendant_errors(self.pendant, moving)

    def _link_name_errors(self) -> Iterator[InputError]:
        named = {
            "root_link": [self.root_link],
            "tool.parent": [self.tool.parent],
            "capsules": list(self.capsules),
            "lumped_links": [*self.lumped_links, *self.lumped_links.values()],
        }
        for key, links in named.items():
            for link in links:
                if link not in self.links:
                    yield InputError(f"the link '{link}' is unknown", key=key, allowed=", ".join(self.links))

    def _check_chain(self) -> None:
        """Moving joints must form one chain: a serial arm, each link with one moving child at most."""
        parents = {joint.child: joint for joint in self.joints}
        if len(parents) != len(self.joints):
            raise InputError("a link has two parents", key="joints", allowed="a serial arm")
        reached = self.root_link
        for joint in self.moving_joints:
            ancestor: str | None = joint.parent
            while ancestor not in (reached, self.root_link, None):
                step = parents.get(str(ancestor))
                if step is None or step.type != "fixed":
                    break
                ancestor = step.parent
            if ancestor != reached:
                raise InputError(
                    f"the joint does not follow the link '{reached}'",
                    key=of_joint(joint.name),
                    allowed="a serial arm, joints in order from the base",
                )
            reached = joint.child

    def check_payload(self, mass_kg: float, *, file: str | Path | None = None, key: str | None = None) -> None:
        """Check that the arm is rated for a payload.

        Args:
            mass_kg: Mass of the payload. [kg]
            file: File that names it, for the message.
            key: Where in the file it is.

        Raises:
            InputError: The payload is heavier than the rated one.
        """
        if mass_kg > self.rated_payload_kg:
            raise InputError(
                f"a payload of {mass_kg:g} kg is more than {self.name} is rated for",
                file=file,
                key=key,
                allowed=f"0 to {self.rated_payload_kg:g} kg",
            )
