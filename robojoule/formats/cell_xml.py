"""Cells in the XML of the published benchmark (CTU in Prague, `EnergyOptimizatorOfRoboticCells`).

A `dataset` holds one or more `instance`s. Numbers `aid`, `lid`, `mid` and `pid` become the names of activities,
locations, movements and power modes. A point is a location of exactly one static activity; movements join points.
"""

from __future__ import annotations

from pathlib import Path

from robojoule.errors import InputError
from robojoule.formats.xml_tree import Element, read_xml
from robojoule.inputs import shown
from robojoule.profile.monomials import MonomialProfile
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

_TEXTS = ("name", "desc")
_LISTS = ("lags.", "handovers.", "collisions.")  # in names of places that are those of cell files


def read_cells(path: str | Path) -> tuple[Cell, ...]:
    """All cells of a file.

    Raises:
        InputError: The file cannot be read, or does not hold cells; names the line.
    """
    root = read_xml(path)
    if root.tag != "dataset":
        raise root.error(f"the root is <{root.tag}>, not a benchmark of cells", allowed="<dataset>")
    root.only(*_TEXTS, "instance")
    cells = tuple(
        _Reader(instance, f"{Path(path).stem}_{number}").cell() for number, instance in enumerate(root.all("instance"))
    )
    if not cells:
        raise root.error("the file holds no <instance>")
    return cells


class _Reader:
    """Reader of one instance."""

    def __init__(self, instance: Element, name: str) -> None:
        self.instance = instance
        self.name = name
        self.points: dict[str, Choice] = {}
        self.elements: dict[str, Element] = {}  # by what the errors of `Cell` name

    def cell(self) -> Cell:
        self.instance.only(*_TEXTS, "robots", "inter-robot-operations", "collision-zones", "production-cycle-time")
        robots_element = self.instance.one("robots")
        robots_element.only("robot")
        robots = tuple(self._robot(element, n) for n, element in enumerate(robots_element.all("robot")))
        lags: list[TimeLag] = []
        handovers: list[Handover] = []
        operations = self.instance.maybe("inter-robot-operations")
        if operations is not None:
            operations.only("operation")
            for operation in operations.all("operation"):
                operation.only(*_TEXTS, "time-compatibility", "spatial-compatibility")
                lags += self._lags(operation, len(lags))
                handovers += self._handovers(operation, len(handovers))
        cycle_time = self.instance.one("production-cycle-time")
        try:
            return Cell(
                self.name, cycle_time.number(), robots, tuple(lags), tuple(handovers), tuple(self._collisions())
            )
        except InputError as error:
            place = self.elements.get(error.key or "", self.instance)
            key = None if (error.key or "").startswith(_LISTS) else error.key
            raise place.error(error.problem, allowed=error.allowed, key=key) from None

    def _robot(self, element: Element, number: int) -> CellRobot:
        element.only(*_TEXTS, "activities", "power-saving-modes")
        name = element.content("name") or f"robot {number}"
        self.elements[f"robot {name}"] = element
        expected: dict[str, float | None] = {}
        modes = []
        modes_element = element.one("power-saving-modes")
        modes_element.only("power-mode")
        for mode in modes_element.all("power-mode"):
            mode.only(*_TEXTS, "minimal-idle-time", "expected-input-power")
            pid, power = mode.attribute("pid"), mode.maybe("expected-input-power")
            label = mode.content("name") or mode.content("desc")
            modes.append(PowerMode(pid, mode.one("minimal-idle-time").number(), label))
            expected[pid] = power.number() if power is not None else None
        activities = element.one("activities")
        activities.only("static-activity", "dynamic-activity")
        static = [self._static(one, expected) for one in activities.all("static-activity")]
        last = [
            one for one in activities.all("static-activity") if one.attributes.get("last_in_cycle") in ("true", "1")
        ]
        if len(last) != 1:
            problem = f"{len(last)} static activities are the last in the cycle"
            raise (last or [activities])[-1].error(problem, allowed='last_in_cycle="true" at exactly one')
        dynamic = [self._dynamic(one) for one in activities.all("dynamic-activity")]
        return CellRobot(name, tuple(modes), tuple(static), tuple(dynamic), last[0].attribute("aid"))

    def _static(self, element: Element, expected: dict[str, float | None]) -> StaticActivity:
        element.only(*_TEXTS, "min-duration", "max-duration", "locations")
        aid = element.attribute("aid")
        self.elements.setdefault(f"activity {aid}", element)
        places = element.one("locations")
        places.only("location")
        return StaticActivity(
            aid,
            element.one("min-duration").number(),
            element.one("max-duration").number(),
            tuple(self._location(place, aid, expected) for place in places.all("location")),
            element.content("name") or element.content("desc"),
        )

    def _location(self, element: Element, aid: str, expected: dict[str, float | None]) -> Location:
        element.only(*_TEXTS, "point", "location-dependent-power-consumption")
        lid, point = element.attribute("lid"), element.one("point")
        number = str(point.whole())
        if number in self.points:
            raise point.error(f"point {number} belongs to two locations")
        self.points[number] = Choice(aid, lid)
        powers = {pid: power for pid, power in expected.items() if power is not None}
        own = element.maybe("location-dependent-power-consumption")
        if own is not None:
            own.only("consumption")
            for consumption in own.all("consumption"):
                pid = consumption.attribute("pid")
                if pid not in expected:
                    raise consumption.error(f"unknown power mode {shown(pid)}", allowed=", ".join(expected))
                powers[pid] = consumption.number("input_power")
        return Location(lid, powers)

    def _dynamic(self, element: Element) -> DynamicActivity:
        element.only(*_TEXTS, "movements")
        aid = element.attribute("aid")
        self.elements.setdefault(f"activity {aid}", element)
        listed = element.one("movements")
        listed.only("movement")
        ends = [listed.attributes.get("from_aid"), listed.attributes.get("to_aid")]
        movements = []
        for movement in listed.all("movement"):
            movement.only(*_TEXTS, "from-point", "to-point", "min-duration", "max-duration", "energy-function")
            options = []
            for side, tag in enumerate(("from-point", "to-point")):
                point = movement.one(tag)
                choice = self.points.get(str(point.whole()))
                if choice is None:
                    raise point.error(f"there is no point {point.text.strip()} of this robot or one before it")
                ends[side] = ends[side] or choice.activity
                if choice.activity != ends[side]:
                    problem = f"point {point.text.strip()} belongs to activity {choice.activity}, not to {ends[side]}"
                    raise point.error(problem, key=f"activity {aid}")
                options.append(choice.option)
            movements.append(Movement(movement.attribute("mid"), options[0], options[1], self._profile(movement)))
        if not movements:
            raise element.error("there is no movement")
        return DynamicActivity(
            aid, str(ends[0]), str(ends[1]), tuple(movements), element.content("name") or element.content("desc")
        )

    @staticmethod
    def _profile(movement: Element) -> MonomialProfile:
        function = movement.one("energy-function")
        function.only("monomial")
        terms = tuple(
            (degree, coefficient)
            for monomial in function.all("monomial")
            for degree, coefficient in [(float(monomial.whole("degree")), monomial.number("coeff"))]
            if coefficient != 0.0
        )
        window = movement.one("min-duration").number(), movement.one("max-duration").number()
        try:
            return MonomialProfile(*window, terms)
        except InputError as error:
            raise movement.error(error.problem, allowed=error.allowed) from None

    def _lags(self, operation: Element, first: int) -> list[TimeLag]:
        listed = operation.maybe("time-compatibility")
        if listed is None:
            return []
        listed.only("time-lag")
        lags = []
        for number, element in enumerate(listed.all("time-lag"), start=first):
            self.elements[f"lags.{number}"] = element
            element.only("from-activity", "to-activity", "length", "height")
            lags.append(
                TimeLag(
                    self._activity(element.one("from-activity")),
                    self._activity(element.one("to-activity")),
                    element.one("length").number(),
                    element.one("height").whole(),
                )
            )
        return lags

    def _activity(self, element: Element) -> str:
        aid = element.text.strip()
        if f"activity {aid}" not in self.elements:
            raise element.error(f"there is no activity {shown(aid)}")
        return aid

    def _handovers(self, operation: Element, before: int) -> list[Handover]:
        listed = operation.maybe("spatial-compatibility")
        if listed is None:
            return []
        listed.only("compatible-pair")
        found: dict[tuple[str, str], list[tuple[str, str]]] = {}
        for pair in listed.all("compatible-pair"):
            pair.only("location")
            ends = [(self._choice_activity(one), one.attribute("lid")) for one in pair.all("location")]
            if len(ends) != 2:
                raise pair.error(f"<compatible-pair> holds {len(ends)} locations", allowed="two")
            (first, one), (second, other) = sorted(
                ends, key=lambda end: list(self.elements).index(f"activity {end[0]}")
            )
            pairs = found.setdefault((first, second), [])
            key = f"handovers.{before + list(found).index((first, second))}"
            self.elements.setdefault(key, pair)
            self.elements[f"{key}.pairs.{len(pairs)}"] = pair
            pairs.append((one, other))
        return [Handover(first, second, tuple(pairs)) for (first, second), pairs in found.items()]

    def _choice_activity(self, element: Element) -> str:
        aid = element.attribute("aid")
        if f"activity {aid}" not in self.elements:
            raise element.error(f"there is no activity {shown(aid)}")
        return aid

    def _collisions(self) -> list[Collision]:
        zones = self.instance.maybe("collision-zones")
        if zones is None:
            return []
        zones.only("collision-pair")
        found: list[Collision] = []
        for pair in zones.all("collision-pair"):
            pair.only("location", "movement")
            ends = [
                Choice(self._choice_activity(one), one.attribute("lid" if one.tag == "location" else "mid"))
                for one in pair.children
            ]
            if len(ends) != 2:
                raise pair.error(f"<collision-pair> holds {len(ends)} choices", allowed="two")
            self.elements[f"collisions.{len(found)}"] = pair
            found.append(Collision(*ends))
        return found
