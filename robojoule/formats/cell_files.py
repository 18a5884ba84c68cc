"""Cells as YAML or JSON files of this project (`format: robojoule-cell`), for reading and writing, and JSON Schema."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from robojoule.documents import Document, parse, read_document, write_document
from robojoule.errors import InputError
from robojoule.profile.monomials import MonomialProfile
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.programs.cell import (
    Cell,
    CellRobot,
    Choice,
    Collision,
    DynamicActivity,
    Handover,
    Location,
    Movement,
    PowerMode,
    StaticActivity,
    TimeLag,
)

SCHEMA_FILE = Path(__file__).with_name("cell.schema.json")
Name = Annotated[str, Field(min_length=1, max_length=200)]
Seconds = Annotated[float, Field(ge=0.0, description="[s]")]


class _Mode(Document):
    name: Name
    least_idle_s: Seconds = 0.0
    label: str = ""


class _Location(Document):
    name: Name
    powers_w: dict[str, float] = Field(description="power in each mode of the robot [W]")


class _Static(Document):
    name: Name
    least_s: Seconds
    longest_s: Seconds
    locations: tuple[_Location, ...]
    label: str = ""


class _Movement(Document):
    """Energy by terms of degree and coefficient, or by breakpoints of a convex profile."""

    name: Name
    start: Name = Field(description="location of the activity before it")
    end: Name = Field(description="location of the activity after it")
    shortest_s: Seconds | None = None
    longest_s: Seconds | None = None
    terms: tuple[tuple[float, float], ...] | None = Field(None, description="degree and coefficient [J/s^degree]")
    durations_s: tuple[float, ...] | None = Field(None, description="breakpoints [s]")
    energies_j: tuple[float, ...] | None = Field(None, description="energies at the breakpoints [J]")

    def profile(self) -> MonomialProfile | PiecewiseLinearProfile:
        """The energy over the duration.

        Raises:
            InputError: It is given by neither or both ways, or is not usable.
        """
        by_terms = [self.shortest_s, self.longest_s, self.terms]
        by_points = [self.durations_s, self.energies_j]
        if None not in by_terms and by_points == [None, None]:
            return MonomialProfile(float(self.shortest_s or 0.0), float(self.longest_s or 0.0), self.terms or ())
        if None not in by_points and by_terms == [None] * 3:
            try:
                return PiecewiseLinearProfile(self.durations_s or (), self.energies_j or ())  # type: ignore[arg-type]
            except ValueError as error:
                raise InputError(str(error)) from None
        raise InputError(
            f"the energy of movement {self.name} must be given in one way",
            allowed="shortest_s, longest_s and terms; or durations_s and energies_j",
        )


class _Dynamic(Document):
    name: Name
    start: Name = Field(description="static activity before it")
    end: Name = Field(description="static activity after it")
    movements: tuple[_Movement, ...]
    label: str = ""


class _Robot(Document):
    name: Name
    last: Name = Field(description="static activity whose end is the end of the robot's cycle")
    modes: tuple[_Mode, ...]
    static: tuple[_Static, ...]
    dynamic: tuple[_Dynamic, ...]


class _Lag(Document):
    """start(second) - start(first) >= length - cycles * cycle time."""

    first: Name
    second: Name
    length_s: float
    cycles: int = 0


class _Handover(Document):
    first: Name
    second: Name
    pairs: tuple[tuple[Name, Name], ...] = Field(description="locations of both that fit together")


class _Collision(Document):
    """Location of a static activity or movement of a dynamic one, and the same of another robot."""

    first: tuple[Name, Name] = Field(description="activity, and its location or movement")
    second: tuple[Name, Name]


class CellDocument(Document):
    """A cell file."""

    format: Literal["robojoule-cell"]
    version: Literal[1]
    name: Name
    cycle_time_s: float = Field(gt=0.0)
    robots: tuple[_Robot, ...]
    lags: tuple[_Lag, ...] = ()
    handovers: tuple[_Handover, ...] = ()
    collisions: tuple[_Collision, ...] = ()

    def cell(self) -> Cell:
        """The cell.

        Raises:
            InputError: It is not consistent; `key` names the robot or the activity.
        """
        return Cell(
            self.name,
            self.cycle_time_s,
            tuple(_robot(one) for one in self.robots),
            tuple(TimeLag(one.first, one.second, one.length_s, one.cycles) for one in self.lags),
            tuple(Handover(one.first, one.second, one.pairs) for one in self.handovers),
            tuple(Collision(Choice(*one.first), Choice(*one.second)) for one in self.collisions),
        )


def _robot(one: _Robot) -> CellRobot:
    dynamic = []
    for activity in one.dynamic:
        movements = []
        for movement in activity.movements:
            try:
                movements.append(Movement(movement.name, movement.start, movement.end, movement.profile()))
            except InputError as error:
                key = f"activity {activity.name}, movement {movement.name}"
                raise InputError(error.problem, key=key, allowed=error.allowed) from None
        dynamic.append(DynamicActivity(activity.name, activity.start, activity.end, tuple(movements), activity.label))
    return CellRobot(
        one.name,
        tuple(PowerMode(mode.name, mode.least_idle_s, mode.label) for mode in one.modes),
        tuple(
            StaticActivity(
                activity.name,
                activity.least_s,
                activity.longest_s,
                tuple(Location(place.name, dict(place.powers_w)) for place in activity.locations),
                activity.label,
            )
            for activity in one.static
        ),
        tuple(dynamic),
        one.last,
    )


def read_cell(path: str | Path) -> Cell:
    """Read a cell file.

    Raises:
        InputError: Unreadable file, unknown or missing key, bad value, or a cell that is not consistent.
    """
    return cell_of(read_document(path), path)


def cell_of(data: Any, path: str | Path) -> Cell:
    """Check plain data of a cell file; see `read_cell`."""
    document = parse(CellDocument, data, path)
    try:
        return document.cell()
    except InputError as error:
        raise InputError(error.problem, file=path, key=error.key, allowed=error.allowed) from None


def write_cell(cell: Cell, path: str | Path) -> None:
    """Write a cell as YAML or JSON (by suffix), atomically.

    Raises:
        InputError: Another suffix, or the file cannot be written.
    """
    write_document(path, cell_data(cell))


def cell_data(cell: Cell) -> dict[str, Any]:
    """A cell as plain data in the form of a cell file."""
    return {
        "format": "robojoule-cell",
        "version": 1,
        "name": cell.name,
        "cycle_time_s": cell.cycle_time_s,
        "robots": [
            {
                "name": robot.name,
                "last": robot.last,
                "modes": [_plain(mode, "name", "least_idle_s", "label") for mode in robot.modes],
                "static": [
                    {
                        **_plain(one, "name", "least_s", "longest_s", "label"),
                        "locations": [{"name": p.name, "powers_w": dict(p.powers_w)} for p in one.locations],
                    }
                    for one in robot.static
                ],
                "dynamic": [
                    {
                        **_plain(one, "name", "start", "end", "label"),
                        "movements": [{**_plain(m, "name", "start", "end"), **_energy(m)} for m in one.movements],
                    }
                    for one in robot.dynamic
                ],
            }
            for robot in cell.robots
        ],
        "lags": [_plain(lag, "first", "second", "length_s", "cycles") for lag in cell.lags],
        "handovers": [
            {**_plain(one, "first", "second"), "pairs": [list(pair) for pair in one.pairs]} for one in cell.handovers
        ],
        "collisions": [{"first": list(one.first), "second": list(one.second)} for one in cell.collisions],
    }


def _plain(one: object, *names: str) -> dict[str, Any]:
    """Attributes by name; labels only where there are any."""
    return {name: value for name in names if (value := getattr(one, name)) != "" or name != "label"}


def _energy(movement: Movement) -> dict[str, Any]:
    profile = movement.profile
    if isinstance(profile, MonomialProfile):
        terms = [list(term) for term in profile.terms]
        return {"shortest_s": profile.d_min_s, "longest_s": profile.d_max_s, "terms": terms}
    return {"durations_s": profile.durations_s.tolist(), "energies_j": profile.energies_j.tolist()}
