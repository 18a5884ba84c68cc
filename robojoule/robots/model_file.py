"""The robot file: kinematics, limits, link inertia, collision capsules and drives of one serial arm."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from robojoule.documents import Document

Vector = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]


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

    @model_validator(mode="after")
    def _limits(self) -> JointFile:
        if self.type == "fixed":
            return self
        for key in ("lower_rad", "upper_rad", "velocity_rad_s", "effort_nm"):
            if getattr(self, key) is None:
                raise ValueError(f"joint '{self.name}' lacks {key}")
        if self.lower_rad >= self.upper_rad:  # type: ignore[operator]
            raise ValueError(f"joint '{self.name}': lower_rad must be below upper_rad")
        if sum(a * a for a in self.axis) == 0:
            raise ValueError(f"joint '{self.name}': the axis must not be zero")
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
    """Drive of one joint; see `robojoule.drive.DriveParameters`."""

    gear_ratio: Positive
    rotor_inertia_kg_m2: NonNegative
    coulomb_nm: NonNegative
    viscous_nm_s_per_rad: NonNegative
    copper_w_per_nm2: NonNegative


class DrivesFile(Document):
    """Drives and controller; see `robojoule.drive.DriveParameters`."""

    provenance: str = Field(min_length=1, description="published, fitted or scaled: from what and how.")
    base_power_w: NonNegative
    drive_active_power_w: NonNegative
    inverter_efficiency: Annotated[float, Field(gt=0, le=1)]
    regeneration_efficiency: Annotated[float, Field(ge=0, le=1)]
    torque_use: Annotated[float, Field(gt=0, le=1)]
    torque_floor: Annotated[float, Field(gt=0, lt=1)]
    filter_time_s: Positive
    joints: dict[str, JointDriveFile]


class RobotFile(Document):
    """One serial arm with any number of joints."""

    name: str = Field(min_length=1)
    vendor: str
    model: str
    rated_payload_kg: NonNegative
    source: str
    license: str
    caveats: str = ""
    root_link: str
    links: dict[str, LinkFile | None]
    joints: list[JointFile] = Field(min_length=1)
    tool: ToolFile
    home_rad: list[float]
    capsules: dict[str, list[CapsuleFile]] = Field(default_factory=dict)
    drives: DrivesFile

    @property
    def moving_joints(self) -> list[JointFile]:
        """The joints that move, from the base to the flange."""
        return [joint for joint in self.joints if joint.type != "fixed"]

    @model_validator(mode="after")
    def _consistent(self) -> RobotFile:
        names = [joint.name for joint in self.joints]
        if len(set(names)) != len(names):
            raise ValueError("joint names must be unique")
        for joint in self.joints:
            for link in (joint.parent, joint.child):
                if link not in self.links:
                    raise ValueError(f"joint '{joint.name}' names the unknown link '{link}'")
        moving = [joint.name for joint in self.moving_joints]
        if not moving:
            raise ValueError("the robot has no moving joint")
        if set(self.drives.joints) != set(moving):
            raise ValueError(f"drives.joints must name exactly the moving joints: {', '.join(moving)}")
        if len(self.home_rad) != len(moving):
            raise ValueError(f"home_rad must have {len(moving)} values, one a moving joint")
        for link in self.capsules:
            if link not in self.links:
                raise ValueError(f"capsules name the unknown link '{link}'")
        self._check_chain()
        return self

    def _check_chain(self) -> None:
        """Moving joints must form one chain: a serial arm, each link with one moving child at most."""
        parents = {joint.child: joint for joint in self.joints}
        if len(parents) != len(self.joints):
            raise ValueError("a link has two parents: only serial arms are supported")
        reached = self.root_link
        for joint in self.moving_joints:
            ancestor: str | None = joint.parent
            while ancestor not in (reached, self.root_link, None):
                step = parents.get(str(ancestor))
                if step is None or step.type != "fixed":
                    break
                ancestor = step.parent
            if ancestor != reached:
                raise ValueError(
                    f"joint '{joint.name}' does not follow link '{reached}': "
                    "only serial arms, joints in order from the base"
                )
            reached = joint.child
