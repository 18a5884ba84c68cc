"""The robot file: kinematics, limits, link inertia, collision capsules and drives of one serial arm."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from robojoule.documents import Document
from robojoule.errors import InputError
from robojoule.inputs import shown
from robojoule.robots.controller_file import ControllerFile
from robojoule.robots.drives import LEAST_CRUISE_SHARE

Vector = tuple[float, float, float]
# What others are divided by: no figure of a machine is smaller, and below it results have no bounds.
LEAST_FIGURE = 1e-6
Positive = Annotated[float, Field(ge=LEAST_FIGURE)]
NonNegative = Annotated[float, Field(ge=0)]
JOINT_TYPES = ("revolute", "fixed")
FigureGroup = Literal["kinematics", "limits", "effort", "peak_effort", "inertia", "capsules", "drives", "supply"]
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


def _of_joint(name: object) -> str:
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
            raise InputError(f"the joint type '{kind}' is unknown", key=_of_joint(name), allowed=", ".join(JOINT_TYPES))
        for key in ("velocity_rad_s", "effort_nm", "peak_effort_nm"):
            value = data.get(key)
            if kind != "fixed" and isinstance(value, (int, float)) and not value >= LEAST_FIGURE:
                allowed = "above 0" if not value > 0 else f"{LEAST_FIGURE:g} or more"
                raise InputError(f"{key} is {shown(value)}", key=_of_joint(name), allowed=allowed)
        return data

    @model_validator(mode="after")
    def _limits(self) -> JointFile:
        if self.type == "fixed":
            return self
        for key in ("lower_rad", "upper_rad", "velocity_rad_s", "effort_nm"):
            if getattr(self, key) is None:
                raise InputError(f"{key} is missing", key=_of_joint(self.name))
        if self.lower_rad >= self.upper_rad:  # type: ignore[operator]
            problem = f"lower_rad {self.lower_rad:g} is not below upper_rad {self.upper_rad:g}"
            raise InputError(problem, key=_of_joint(self.name))
        if self.peak_effort_nm is not None and self.peak_effort_nm < self.effort_nm:  # type: ignore[operator]
            problem = f"peak_effort_nm {self.peak_effort_nm:g} is below effort_nm {self.effort_nm:g}"
            raise InputError(problem, key=_of_joint(self.name))
        if sum(a * a for a in self.axis) == 0:
            raise InputError("the axis is zero", key=_of_joint(self.name), allowed="a direction")
        return self


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
    figures hold its inertia, as some vendors publish wrists.
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
    controller: ControllerFile | None = Field(default=None, description="Its timing, where that was learnt.")
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
        moving = [index for index, joint in enumerate(self.joints) if joint.type != "fixed"]
        first = moving[min(1, len(moving) - 1)]
        steps = [joint.origin_xyz_m for joint in self.joints[first + 1 :]]
        return sum(math.hypot(*step) for step in [*steps, self.tool.origin_xyz_m])

    @property
    def installed_power_w(self) -> float:
        """Sum over the joints of effort limit times velocity limit: a measure of the drives' size. [W]"""
        return sum((joint.effort_nm or 0.0) * (joint.velocity_rad_s or 0.0) for joint in self.moving_joints)

    @model_validator(mode="after")
    def _consistent(self) -> RobotFile:
        names = [joint.name for joint in self.joints]
        if len(set(names)) != len(names):
            raise InputError("two joints have the same name", key="joints", allowed="unique names")
        known = ", ".join(self.links)
        for joint in self.joints:
            for link in (joint.parent, joint.child):
                if link not in self.links:
                    raise InputError(f"the link '{link}' is unknown", key=_of_joint(joint.name), allowed=known)
        moving = [joint.name for joint in self.moving_joints]
        if not moving:
            raise InputError("the robot has no moving joint", key="joints", allowed="at least one")
        if set(self.drives.joints) != set(moving):
            named = ", ".join(self.drives.joints) or "none"
            raise InputError(
                f"these are not the moving joints: {named}", key="drives.joints", allowed=f"exactly {', '.join(moving)}"
            )
        if self.controller is not None and set(self.controller.joints) != set(moving):
            named = ", ".join(self.controller.joints) or "none"
            raise InputError(
                f"these are not the moving joints: {named}",
                key="controller.joints",
                allowed=f"exactly {', '.join(moving)}",
            )
        if len(self.home_rad) != len(moving):
            problem = f"{len(self.home_rad)} values are given"
            raise InputError(problem, key="home_rad", allowed=f"{len(moving)} values, one per moving joint")
        self._check_link_names()
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

    def _check_link_names(self) -> None:
        named = {
            "root_link": [self.root_link],
            "tool.parent": [self.tool.parent],
            "capsules": list(self.capsules),
            "lumped_links": [*self.lumped_links, *self.lumped_links.values()],
        }
        for key, links in named.items():
            for link in links:
                if link not in self.links:
                    raise InputError(f"the link '{link}' is unknown", key=key, allowed=", ".join(self.links))

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
                    key=_of_joint(joint.name),
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
