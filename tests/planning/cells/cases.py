"""Small cells for tests, by hand and from seeds."""

from __future__ import annotations

from dataclasses import replace

from benchmarks.generated_cells import generate_cell
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

MODES = (PowerMode("on", 0.0), PowerMode("brakes", 1.0))


def moving(name: str, start: str, end: str, *options: tuple[str, str, float, float]) -> DynamicActivity:
    """A dynamic activity with a movement for each start, end, shortest duration and rising power."""
    movements = tuple(
        Movement(f"{a}{b}", a, b, MonomialProfile(least, 6.0, ((-1.0, power * (1.6 * least) ** 2), (1.0, power))))
        for a, b, least, power in options
    )
    return DynamicActivity(name, start, end, movements)


def standing(name: str, least: float, longest: float, **powers: tuple[float, float]) -> StaticActivity:
    """A static activity with locations by their powers with motors on and with brakes."""
    places = tuple(Location(place, {"on": on, "brakes": brakes}) for place, (on, brakes) in powers.items())
    return StaticActivity(name, least, longest, places)


def two_robots(cycle_time_s: float = 9.0) -> Cell:
    """A may do a1 and a2 in either order and a1 in two poses, B passes a part to a1, movements of both collide."""
    a = CellRobot(
        "A",
        MODES,
        (
            standing("a0", 0.5, 20.0, p=(200.0, 120.0)),
            standing("a1", 0.6, 20.0, p=(260.0, 150.0), q=(180.0, 110.0)),
            standing("a2", 0.4, 0.9, p=(220.0, 130.0)),
        ),
        (
            moving("a0>a1", "a0", "a1", ("p", "p", 0.8, 210.0), ("p", "q", 1.1, 250.0)),
            moving("a1>a2", "a1", "a2", ("p", "p", 0.9, 230.0), ("q", "p", 1.0, 200.0)),
            moving("a2>a0", "a2", "a0", ("p", "p", 0.7, 240.0)),
            moving("a0>a2", "a0", "a2", ("p", "p", 0.6, 220.0)),
            moving("a2>a1", "a2", "a1", ("p", "p", 0.9, 260.0), ("p", "q", 1.2, 230.0)),
            moving("a1>a0", "a1", "a0", ("p", "p", 0.9, 240.0), ("q", "p", 0.8, 250.0)),
        ),
        "a0",
    )
    b = CellRobot(
        "B",
        MODES,
        (standing("b0", 0.5, 20.0, p=(210.0, 110.0)), standing("b1", 1.0, 2.5, p=(250.0, 140.0), q=(230.0, 135.0))),
        (
            moving("b0>b1", "b0", "b1", ("p", "p", 1.0, 240.0), ("p", "q", 1.3, 220.0)),
            moving("b1>b0", "b1", "b0", ("p", "p", 1.1, 250.0), ("q", "p", 0.9, 260.0)),
        ),
        "b0",
    )
    return Cell(
        "two robots",
        cycle_time_s,
        (a, b),
        (TimeLag("b1>b0", "a1", 0.2, 0), TimeLag("a1", "b1", 1.0, 1)),
        (Handover("a1", "b1", (("p", "p"), ("p", "q"), ("q", "q"))),),
        (Collision(Choice("a2>a0", "pp"), Choice("b0>b1", "pp")), Collision(Choice("a2", "p"), Choice("b0>b1", "pq"))),
    )


def free_of_charge() -> Cell:
    """Two robots without anything between them, and without energy."""
    cell = replace(two_robots(), handovers=(), collisions=(), lags=())
    robots = []
    for robot in cell.robots:
        static = tuple(
            replace(one, locations=tuple(replace(p, powers_w=dict.fromkeys(p.powers_w, 0.0)) for p in one.locations))
            for one in robot.static
        )
        dynamic = tuple(
            replace(
                one,
                movements=tuple(
                    replace(m, profile=MonomialProfile(m.profile.d_min_s, m.profile.d_max_s, ((0.0, 0.0),)))
                    for m in one.movements
                ),
            )
            for one in robot.dynamic
        )
        robots.append(replace(robot, static=static, dynamic=dynamic))
    return replace(cell, robots=tuple(robots))


SEEDS = [(2, 0, (4, 6)), (2, 1, (4, 6)), (3, 5, (3, 5))]


def generated(robots: int, seed: int, activities: tuple[int, int]) -> Cell:
    """A cell from a seed."""
    return generate_cell(robots, seed, activities)[0]
