"""What programs leave in the controller, as a YAML or JSON file beside them: tools, bases, payloads, waits."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from robojoule.documents import Document, load
from robojoule.errors import InputError
from robojoule.formats.vendor.trace import Beside
from robojoule.inputs import LONGEST_S, number_of, shown
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload

FARTHEST_MM = 1e5  # of a tool or a base: beyond it the unit is wrong
Triple = tuple[float, float, float]


class FrameFile(Document):
    """A tool on the flange, or a base in the robot's own base frame."""

    xyz_mm: Triple = Field(default=(0.0, 0.0, 0.0), description="Origin. [mm]")
    rpy_deg: Triple = Field(
        default=(0.0, 0.0, 0.0),
        description="Turns about the fixed axes x, then y, then z: KUKA's C, B, A, FANUC's W, P, R. [deg]",
    )

    def placement(self) -> Placement:
        """The frame."""
        return frame(*self.xyz_mm, *self.rpy_deg)


class PayloadFile(Document):
    """A payload by the controller's number."""

    mass_kg: Annotated[float, Field(ge=0.0)] = Field(description="Mass. [kg]")
    com_mm: Triple = Field(default=(0.0, 0.0, 100.0), description="Centre of mass in the frame of the flange. [mm]")

    def payload(self) -> Payload:
        """The payload."""
        x, y, z = self.com_mm
        return Payload(self.mass_kg, (x / 1e3, y / 1e3, z / 1e3))


class ControllerData(Document):
    """A file of what stands in the controller."""

    format: Literal["robojoule-controller-data"]
    version: Literal[1]
    tools: dict[str, FrameFile] = Field(default_factory=dict, description="Tools by number or name.")
    bases: dict[str, FrameFile] = Field(default_factory=dict, description="Bases (user frames) by number or name.")
    payloads: dict[str, PayloadFile] = Field(default_factory=dict, description="Payloads by number or name.")
    positions_deg: dict[str, list[float]] = Field(
        default_factory=dict, description="Joint positions by name (XHOME, PR[1]), as the pendant shows them. [deg]"
    )
    still: list[str] = Field(
        default_factory=list, description="Programs, macros and routines of other files that do not move the robot."
    )
    waits_s: dict[str, Annotated[float, Field(ge=0.0, le=LONGEST_S)]] = Field(
        default_factory=dict, description="How long waits take that the program does not say, by their line. [s]"
    )


def read_controller_data(path: str | Path) -> Beside:
    """Read a file of what stands in the controller.

    Raises:
        InputError: It cannot be read, or has other keys or values than it may have.
    """
    data = load(ControllerData, path)
    waits = {_line(line, path): seconds for line, seconds in data.waits_s.items()}
    return Beside(
        tools={name: one.placement() for name, one in data.tools.items()},
        bases={name: one.placement() for name, one in data.bases.items()},
        payloads={name: one.payload() for name, one in data.payloads.items()},
        waits_s=waits,
        positions_rad={
            name.upper(): tuple(math.radians(angle) for angle in one) for name, one in data.positions_deg.items()
        },
        still=frozenset(name.upper() for name in data.still),
    )


def frame(*values: float) -> Placement:
    """A frame by x, y, z [mm] and turns about the fixed axes x, then y, then z [deg], which may be left out.

    Raises:
        InputError: There are neither three nor six numbers, or the origin is too far away.
    """
    if len(values) not in (3, 6):
        problem = f"{len(values)} numbers are not a frame"
        raise InputError(problem, allowed="x,y,z in mm, and turns about x, y, z in degrees")
    x, y, z, *turns = values
    if not max(abs(x), abs(y), abs(z)) <= FARTHEST_MM:
        raise InputError("the frame is too far away", allowed=f"{-FARTHEST_MM:g} to {FARTHEST_MM:g} mm")
    roll, pitch, yaw = (math.radians(value) for value in (turns or (0.0, 0.0, 0.0)))
    return Placement.of((x / 1e3, y / 1e3, z / 1e3), (roll, pitch, yaw))


def wait_of(text: str) -> tuple[int, float]:
    """Line and duration of a wait as it is given: "12=1.5".

    Raises:
        InputError: It is something else.
    """
    line, _, seconds = text.partition("=")
    try:
        value = number_of(seconds.strip().removesuffix("s"))
        if line.strip().isascii() and line.strip().isdigit() and 0.0 <= value <= LONGEST_S:
            return int(line), value
    except ValueError:
        pass
    raise InputError(f"{shown(text)} is not a wait", allowed="a line and seconds, such as 12=1.5")


def _line(text: Any, path: str | Path) -> int:
    if text.isascii() and text.isdigit():
        return int(text)
    raise InputError(f"{shown(text)} is not the number of a line", file=path, key="waits_s")
