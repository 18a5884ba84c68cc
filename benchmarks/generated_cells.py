"""Cells of any size from a seed, each with a plan that it was built around: so it has one, and tests know one.

A robot's activities stand in blocks of one to four whose order is free; activities have one to four locations, robots
one to three power modes. Neighbouring robots pass parts over common benches (time lags both ways, locations that must
fit), and movements of different robots that are apart in the known plan are made to collide.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from robojoule.formats.cell_files import write_cell
from robojoule.planning.cells.plan import CellPlan, Step
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

LARGEST_BLOCK = 4
MOST_LOCATIONS = 4
CARRIED_M_S = 0.9  # mean speed of the fastest movements
BENCHES = 2  # between neighbouring robots, at most
COLLISIONS = 6  # between neighbouring robots, at most


@dataclass
class _Robot:
    """A robot that is being made, and its part of the known plan."""

    name: str
    modes: tuple[PowerMode, ...]
    static: list[StaticActivity] = field(default_factory=list)
    dynamic: list[DynamicActivity] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list)


def generate_cell(robots: int, seed: int, activities: tuple[int, int] = (8, 16)) -> tuple[Cell, CellPlan]:
    """A cell and a feasible plan of it.

    Args:
        robots: Number of robots.
        seed: The same seed gives the same cell.
        activities: Fewest and most static activities of a robot.

    Returns:
        The cell, and the plan that it was built around: feasible, not optimal.
    """
    rng = np.random.default_rng([robots, seed])
    made = [_robot(rng, r, int(rng.integers(activities[0], activities[1] + 1))) for r in range(robots)]
    cycle_time = round(1.02 * max(sum(step.duration_s for step in one.steps) for one in made), 4)
    for one in made:
        _place(rng, one, cycle_time)
    lags: list[TimeLag] = []
    handovers: list[Handover] = []
    collisions: list[Collision] = []
    for first, second in pairwise(made):
        new_lags, new_handovers = _benches(rng, first, second, cycle_time)
        lags += new_lags
        handovers += new_handovers
        collisions += _collisions(rng, first, second, cycle_time)
    name = f"generated_{robots}_{seed}"
    cell = Cell(
        name,
        cycle_time,
        tuple(
            CellRobot(one.name, one.modes, tuple(one.static), tuple(one.dynamic), one.static[0].name) for one in made
        ),
        tuple(lags),
        tuple(handovers),
        tuple(collisions),
    )
    steps = tuple(step for one in made for step in one.steps)
    return cell, CellPlan(name, cycle_time, steps, "feasible", 0.0)


def _robot(rng: np.random.Generator, number: int, count: int) -> _Robot:
    """A robot with its activities, and a tour through them at leisurely speeds."""
    kinds = int(rng.integers(1, 4))
    idle = [0.0, float(np.round(rng.uniform(1.5, 3.0), 3)), float(np.round(rng.uniform(8.0, 15.0), 3))]
    labels = ("motors on", "brakes", "bus off")
    robot = _Robot(f"R{number}", tuple(PowerMode(f"M{k}", idle[k], labels[k]) for k in range(kinds)))
    points = []
    for v in range(count):
        places = rng.uniform(-1.0, 1.0, (int(rng.integers(1, MOST_LOCATIONS + 1)), 3)) * [1.0, 1.0, 0.4]
        points.append(places)
        least = float(np.round(rng.uniform(0.3, 3.0), 3))
        longest = float(np.round(least + rng.choice([0.0, 2.0, 30.0]), 3)) if v else least + 1000.0
        power = np.round(rng.uniform(180.0, 320.0, len(places)), 2)
        shares = (1.0, 0.55, 0.3)
        locations = tuple(
            Location(f"L{k}", {f"M{m}": float(np.round(power[k] * shares[m], 2)) for m in range(kinds)})
            for k in range(len(places))
        )
        robot.static.append(StaticActivity(f"R{number}.S{v}", least, longest, locations))
    _connect(rng, robot, points)
    return robot


def _connect(rng: np.random.Generator, robot: _Robot, points: list[np.ndarray]) -> None:
    """Blocks of activities whose order is free, the movements between them, and a tour through all."""
    blocks, v = [[0]], 1
    while v < len(points):
        size = min(int(rng.integers(1, LARGEST_BLOCK + 1)), len(points) - v)
        blocks.append(list(range(v, v + size)))
        v += size
    arcs = [(a, b) for block in blocks for a in block for b in block if a != b]
    for block, after in zip(blocks, [*blocks[1:], blocks[0]], strict=True):
        arcs += [(a, b) for a in block for b in after]
    made = {}
    for a, b in arcs:
        name = f"{robot.static[a].name}>{b}"
        movements = tuple(
            Movement(f"{i}-{j}", f"L{i}", f"L{j}", _profile(rng, float(np.linalg.norm(p - q))))
            for i, p in enumerate(points[a])
            for j, q in enumerate(points[b])
        )
        made[a, b] = DynamicActivity(name, robot.static[a].name, robot.static[b].name, movements)
    robot.dynamic = list(made.values())
    order = [int(v) for block in blocks[1:] for v in rng.permutation(block)] + [0]
    place = {v: int(rng.integers(len(points[v]))) for v in order}
    before = 0
    for v in order:
        activity = made[before, v]
        movement = next(one for one in activity.movements if one.name == f"{place[before]}-{place[v]}")
        duration = movement.profile.d_min_s * float(rng.uniform(1.05, 1.5))
        robot.steps.append(
            _step(robot, activity.name, movement.name, None, duration, float(movement.profile.value(duration)))
        )
        static = robot.static[v]
        stay = min(static.least_s * float(rng.uniform(1.0, 1.3)), static.longest_s)
        robot.steps.append(_step(robot, static.name, f"L{place[v]}", "M0", stay, 0.0))
        before = v


def _profile(rng: np.random.Generator, distance_m: float) -> MonomialProfile:
    """Energy of a movement: falling by what speed costs, rising by what standing costs."""
    shortest = round(0.35 + distance_m / CARRIED_M_S * float(rng.uniform(0.9, 1.2)), 4)
    rising = float(rng.uniform(200.0, 330.0))
    best = shortest * float(rng.uniform(1.2, 2.0))
    terms = (
        (-1.0, round(rising * best * best, 3)),
        (0.0, round(float(rng.uniform(0.0, 60.0)), 3)),
        (1.0, round(rising, 3)),
    )
    return MonomialProfile(shortest, round(8.0 * shortest, 4), terms)


def _step(robot: _Robot, activity: str, option: str, mode: str | None, duration_s: float, energy_j: float) -> Step:
    return Step(robot.name, activity, option, mode, 0.0, duration_s, energy_j)


def _place(rng: np.random.Generator, robot: _Robot, cycle_time_s: float) -> None:
    """Fill the cycle by the wait of the last activity and put the robot's cycle anywhere in that of the cell."""
    steps = robot.steps
    missing = cycle_time_s - math.fsum(step.duration_s for step in steps)
    start = float(np.round(rng.uniform(0.0, cycle_time_s), 3))
    powers = {(one.name, place.name): place.powers_w for one in robot.static for place in one.locations}
    placed = []
    for number, step in enumerate(steps):
        duration = step.duration_s + (missing if number == len(steps) - 1 else 0.0)
        energy = powers[step.activity, step.option]["M0"] * duration if step.mode else step.energy_j
        placed.append(Step(step.robot, step.activity, step.option, step.mode, start, duration, energy))
        start += duration
    robot.steps = placed


def _benches(
    rng: np.random.Generator, first: _Robot, second: _Robot, cycle_time_s: float
) -> tuple[list[TimeLag], list[Handover]]:
    """Parts that pass from one robot to the other: one comes when the other has left, both ways around the cycle."""
    lags: list[TimeLag] = []
    handovers: list[Handover] = []
    stands, others = (one.steps[1:-2:2] for one in (first, second))
    pairs = [(a, b) for a in stands for b in others if _overlap_s(a, b, cycle_time_s) <= 0.0]
    used: set[str] = set()
    for number in rng.permutation(len(pairs)):
        a, b = pairs[int(number)]
        if len(handovers) == BENCHES or {a.activity, b.activity} & used:
            continue
        used |= {a.activity, b.activity}
        for here, there, robot in ((a, b, first), (b, a, second)):
            end = here.start_s + here.duration_s
            cycles = math.ceil((end - there.start_s) / cycle_time_s - 1e-9)
            lags += [
                TimeLag(one.name, there.activity, 0.0, cycles) for one in robot.dynamic if one.start == here.activity
            ]
        places, fits = (
            next(one for one in robot.static if one.name == step.activity).locations
            for robot, step in ((first, a), (second, b))
        )
        fitting = {(a.option, b.option)}
        for place in places:
            fitting |= {(place.name, other.name) for other in fits if rng.random() < 0.4}
        handovers.append(Handover(a.activity, b.activity, tuple(sorted(fitting))))
    return lags, handovers


def _collisions(rng: np.random.Generator, first: _Robot, second: _Robot, cycle_time_s: float) -> list[Collision]:
    """Choices of both robots that exclude each other; those of the known plan do not take place at the same time."""
    known = {step.activity: step for one in (first, second) for step in one.steps}
    found: list[Collision] = []
    for _ in range(4 * COLLISIONS):
        ends = []
        for robot in (first, second):
            activity = robot.dynamic[int(rng.integers(len(robot.dynamic)))]
            step = known.get(activity.name)
            wanted = (
                step.option if step and rng.random() < 0.7 else rng.choice([one.name for one in activity.movements])
            )
            ends.append(Choice(activity.name, str(wanted)))
        a, b = (known.get(end.activity) for end in ends)
        both = a and b and (a.option, b.option) == (ends[0].option, ends[1].option)
        if not (both and _overlap_s(a, b, cycle_time_s) > 0.0) and len(found) < COLLISIONS:
            found.append(Collision(*ends))
    return sorted(set(found))


def _overlap_s(a: Step | None, b: Step | None, cycle_time_s: float) -> float:
    """By how much two steps are at most from being apart in a cycle that repeats. [s]"""
    if a is None or b is None:
        return 0.0
    shift = (b.start_s - a.start_s) % cycle_time_s
    return max(a.duration_s - shift, shift + b.duration_s - cycle_time_s) + 0.05


def main() -> None:
    """Write a cell."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.generated_cells", description=__doc__)
    parser.add_argument("--robots", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--activities", type=int, nargs=2, default=(8, 16), metavar=("FEWEST", "MOST"))
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="cell file (.json, .yaml)")
    given = parser.parse_args()
    cell, _ = generate_cell(given.robots, given.seed, tuple(given.activities))
    write_cell(cell, given.out)
    print(cell)


if __name__ == "__main__":
    main()
