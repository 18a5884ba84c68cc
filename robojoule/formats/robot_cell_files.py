"""Cells of robots as YAML or JSON files (`format: robojoule-robot-cell`): reading with clear errors, JSON Schema."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from robojoule.documents import Document, parse, read_document, write_document
from robojoule.errors import InputError
from robojoule.formats.joint_motions import as_joint_motions
from robojoule.formats.program import Program, load_program
from robojoule.formats.robot_cell import (
    FARTHEST_M,
    SAFETY_DISTANCE_M,
    Alternatives,
    PartHandover,
    Place,
    PlacedRobot,
    RobotCell,
    Zone,
)
from robojoule.formats.tree_files import parse_tree
from robojoule.inputs import LONGEST_S
from robojoule.programs.operation_tree import FORMAT, FORMAT_VERSION, MOST_POWER_W
from robojoule.programs.sections import unknown_operations
from robojoule.robots import load_robot
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Robot
from robojoule.robots.standby import StandbyFile

SCHEMA_FILE = Path(__file__).with_name("robot-cell.schema.json")
Name = Annotated[str, Field(min_length=1, max_length=200)]
Meters = Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M)]


class _Base(Document):
    """Where the base frame of a robot is in the cell, whose axis z points up."""

    position_m: tuple[Meters, Meters, Meters] = Field(default=(0.0, 0.0, 0.0), description="[m]")
    turned_deg: tuple[float, float, float] = Field(
        default=(0.0, 0.0, 0.0), description="turns about the axes x, y and z of the cell, in this order [deg]"
    )

    def placement(self) -> Placement:
        roll, pitch, yaw = (math.radians(angle) for angle in self.turned_deg)
        return Placement.of(self.position_m, (roll, pitch, yaw))


class _Alternatives(Document):
    """Other targets of a move, one of which may be taken for that of the program."""

    move: Name
    given: Name = Field(description="name of the target that the program has")
    poses_deg: dict[Name, tuple[float, ...]] | None = Field(default=None, description="[deg]")
    poses_rad: dict[Name, tuple[float, ...]] | None = Field(default=None, description="[rad]")

    def alternatives(self) -> Alternatives:
        if (self.poses_deg is None) == (self.poses_rad is None):
            raise InputError(f"the poses of move '{self.move}' must be given once", allowed="poses_deg or poses_rad")
        if self.poses_rad is not None:
            return Alternatives(self.given, self.poses_rad)
        degrees = self.poses_deg or {}
        return Alternatives(self.given, {name: tuple(np.radians(pose).tolist()) for name, pose in degrees.items()})


class _PlacedRobot(Document):
    name: Name
    robot: str = Field(description="catalog name of the robot, or its file, from the folder of the cell file")
    payload_kg: float = Field(default=0.0, ge=0.0, description="[kg]")
    base: _Base = _Base()
    program: str | dict[str, Any] = Field(
        description="file of its program, from the folder of the cell file; or the operation tree itself, of which "
        "format, version and name may be left out"
    )
    alternatives: tuple[_Alternatives, ...] = ()
    standby: StandbyFile | None = Field(default=None, description="in place of that of the robot's file")


class _Place(Document):
    """An operation of a robot."""

    robot: Name
    operation: Name = Field(description="process step or wait; of a move the standing at its target is meant")


class _Handover(Document):
    """The second starts when the first has ended, or later."""

    first: _Place
    second: _Place
    lag_s: float = Field(default=0.0, ge=0.0, le=LONGEST_S, description="[s]")
    cycles: int = Field(default=0, ge=-1000, le=1000, description="by how many cycles the second may belong to a later")
    poses: tuple[tuple[Name, Name], ...] | None = Field(default=None, description="poses of both that fit; any if none")


class _Member(Document):
    """An operation in a zone: a move from its start to its end, or standing for a step or a wait."""

    robot: Name
    operation: Name


class _Zone(Document):
    """Space in which only one robot may be at a time."""

    name: Name
    members: tuple[_Member, ...]


class RobotCellDocument(Document):
    """A cell of robots with their programs."""

    format: Literal["robojoule-robot-cell"]
    version: Literal[1]
    name: Name
    cycle_time_s: float = Field(gt=0.0, le=LONGEST_S, description="[s]")
    safety_distance_m: float = Field(
        default=SAFETY_DISTANCE_M, ge=0.0, le=10.0, description="that the robots keep from each other [m]"
    )
    peak_power_w: float | None = Field(
        default=None, gt=0.0, le=MOST_POWER_W, description="largest mains power of all robots together [W]"
    )
    robots: tuple[_PlacedRobot, ...]
    handovers: tuple[_Handover, ...] = ()
    zones: tuple[_Zone, ...] = ()


def robot_cell_of(data: Any, path: str | Path) -> RobotCell:
    """Check plain data of a cell of robots, and read what it names.

    Args:
        data: What the file holds.
        path: The file, from whose folder other files are named.

    Raises:
        InputError: Unknown or missing key, bad value, a robot or program that cannot be read or does not fit.
    """
    document = parse(RobotCellDocument, data, path)
    folder = Path(path).parent
    try:
        return RobotCell(
            document.name,
            document.cycle_time_s,
            tuple(_placed(one, folder, path) for one in document.robots),
            tuple(
                PartHandover(
                    Place(one.first.robot, one.first.operation),
                    Place(one.second.robot, one.second.operation),
                    one.lag_s,
                    one.cycles,
                    one.poses,
                )
                for one in document.handovers
            ),
            tuple(Zone(one.name, tuple(Place(m.robot, m.operation) for m in one.members)) for one in document.zones),
            document.safety_distance_m,
            document.peak_power_w,
            Path(path),
        )
    except InputError as error:
        if error.file is not None:
            raise
        raise InputError(error.problem, file=path, key=error.key, allowed=error.allowed) from None


def read_robot_cell(path: str | Path) -> RobotCell:
    """Read a cell of robots.

    Raises:
        InputError: See `robot_cell_of`.
    """
    return robot_cell_of(read_document(path), path)


def _placed(one: _PlacedRobot, folder: Path, path: str | Path) -> PlacedRobot:
    key = f"robot {one.name}"
    is_file = Path(one.robot).suffix.lower() in (".json", ".yaml", ".yml", ".urdf", ".xacro")
    try:
        robot = load_robot(folder / one.robot if is_file else one.robot, payload_kg=one.payload_kg)
        if one.standby is not None:
            robot = Robot(robot.file.model_copy(update={"standby": one.standby}), robot.payload, robot.source)
        program = _program(one, robot, folder, path)
        program.check(robot)
        tree, assumed = as_joint_motions(program.tree, robot)
        program = replace(program, tree=tree) if assumed else program
        if unknown := unknown_operations(program.tree):
            problem = f"nobody knows how long operation '{unknown[0].name}' takes"
            raise InputError(problem, allowed="a program whose operations all have their durations")
        alternatives = {entry.move: entry.alternatives() for entry in one.alternatives}
        if len(alternatives) < len(one.alternatives):
            raise InputError("alternatives of a move are given twice")
    except InputError as error:
        if error.file is not None and error.file != str(path):
            raise
        where = f"{key}, {error.key}" if error.key else key
        raise InputError(error.problem, file=path, key=where, allowed=error.allowed) from None
    return PlacedRobot(one.name, robot, one.base.placement(), program, alternatives, assumed)


def _program(one: _PlacedRobot, robot: Robot, folder: Path, path: str | Path) -> Program:
    if isinstance(one.program, str):
        return load_program(folder / one.program, robot)
    head = {"format": FORMAT, "version": FORMAT_VERSION, "name": one.name}
    return Program(parse_tree({**head, **one.program}, path))


def robot_cell_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the file format, generated from the models."""
    schema = RobotCellDocument.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def write_schema() -> None:
    """Write the JSON Schema that is shipped with the package anew."""
    write_document(SCHEMA_FILE, robot_cell_schema())
