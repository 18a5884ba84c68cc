"""Plans of cells against published results.

`python -m benchmarks.cells --instances FOLDER [--seconds S] [--seeds 1,2,3] [NAME ...]`: FOLDER holds the XML files of
the published benchmark, which is not part of this project. Without it, cells of `benchmarks.generated_cells` are
planned. Every plan passes the independent check; one line of JSON for each cell and seed, and one with the median
where a cell has several.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.generated_cells import generate_cell
from robojoule.errors import RobojouleError
from robojoule.formats.cell_xml import read_cells
from robojoule.planning.cells.check import check_plan
from robojoule.planning.cells.plan import CellPlan
from robojoule.planning.cells.solve import SearchProgress, solve_cell
from robojoule.profile.monomials import MonomialProfile
from robojoule.programs.cell import Cell, DynamicActivity, StaticActivity

GENERATED = [(2, 0, (4, 6)), (2, 1, (6, 8)), (3, 0, (4, 7)), (4, 0, (6, 9)), (6, 0, (8, 12)), (12, 0, (8, 12))]


def cells(folder: Path | None, names: list[str]) -> Iterator[Cell]:
    """Cells to plan."""
    if folder is None:
        yield from (generate_cell(*one)[0] for one in GENERATED)
        return
    for path in sorted(folder.glob("*.xml")):
        yield from (cell for cell in read_cells(path) if not names or any(name in cell.name for name in names))


def at_full_speed(cell: Cell) -> Cell:
    """The cell with every movement at its shortest duration; the robots may wait wherever they stand."""

    def fastest(activity: DynamicActivity) -> DynamicActivity:
        movements = []
        for one in activity.movements:
            d, profile = one.profile.d_min_s, one.profile
            energy = float(profile.value(d))
            movements.append(replace(one, profile=MonomialProfile(d, d, ((0.0, energy),))))
        return replace(activity, movements=tuple(movements))

    def waiting(activity: StaticActivity) -> StaticActivity:
        return replace(activity, longest_s=max(activity.longest_s, cell.cycle_time_s))

    robots = tuple(
        replace(one, static=tuple(map(waiting, one.static)), dynamic=tuple(map(fastest, one.dynamic)))
        for one in cell.robots
    )
    return replace(cell, robots=robots)


def with_modes(cell: Cell, count: int) -> Cell:
    """The cell with only the first power modes of each robot."""
    robots = []
    for robot in cell.robots:
        kept = robot.modes[:count]
        names = {mode.name for mode in kept}
        static = tuple(
            replace(
                one,
                locations=tuple(
                    replace(place, powers_w={m: p for m, p in place.powers_w.items() if m in names})
                    for place in one.locations
                ),
            )
            for one in robot.static
        )
        robots.append(replace(robot, modes=kept, static=static))
    return replace(cell, robots=tuple(robots))


def result(cell: Cell, seconds: float, threads: int, seed: int) -> dict[str, Any]:
    """Figures of one cell."""
    told: list[SearchProgress] = []
    try:
        plan: CellPlan = solve_cell(cell, time_limit_s=seconds, threads=threads, seed=seed, progress=told.append)
    except RobojouleError as error:
        return {"cell": cell.name, "seed": seed, "message": str(error)}
    first = next((one.done for one in told if one.energy_j < float("inf")), plan.runtime_s)
    return {
        "cell": cell.name,
        "seed": seed,
        "status": plan.status,
        "feasible": check_plan(cell, plan).feasible,
        "energy_j": round(plan.energy_j, 2),
        "bound_j": round(plan.bound_j, 2),
        "gap_percent": round(plan.gap_percent, 4),
        "first_plan_s": round(first, 2),
        "runtime_s": round(plan.runtime_s, 2),
    }


def main() -> None:
    """Plan the cells, one after another."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cells", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="only cells whose name holds one of these")
    parser.add_argument("--instances", type=Path, metavar="FOLDER")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seeds", default="0", help="of each cell one after another, joined by commas")
    parser.add_argument("--savings", action="store_true", help="savings by speeds and modes against full speed")
    given = parser.parse_args()
    for cell in cells(given.instances, given.names):
        if given.savings:
            print(json.dumps({"cell": cell.name, **savings(cell, given.seconds)}), flush=True)
            continue
        found = []
        for seed in map(int, given.seeds.split(",")):
            found.append(result(cell, given.seconds, given.threads, seed))
            print(json.dumps(found[-1]), flush=True)
        if len(found) > 1:
            print(json.dumps({"cell": cell.name, **medians(found)}), flush=True)


def medians(results: list[dict[str, Any]]) -> dict[str, float]:
    """Medians of some results of a cell and the worst energy; a seed without a plan counts as infinitely bad."""
    energies = [one.get("energy_j", math.inf) for one in results]
    gaps = [one.get("gap_percent", math.inf) for one in results]
    return {
        "median_energy_j": median(energies),
        "worst_energy_j": max(energies),
        "median_gap_percent": median(gaps),
        "worst_first_plan_s": max(one.get("first_plan_s", math.inf) for one in results),
    }


def savings(cell: Cell, seconds: float) -> dict[str, float]:
    """What speeds and power modes save against full speed with the first mode, and with the first two. [%]"""
    most = max(len(robot.modes) for robot in cell.robots)

    def energy(one: Cell) -> float:
        return solve_cell(one, time_limit_s=seconds).energy_j

    motors, brakes = (energy(at_full_speed(with_modes(cell, count))) for count in (1, 2))
    found = {"full_speed_j": round(motors, 1), "full_speed_brakes_j": round(brakes, 1)}
    for name, planned in (
        ("modes", energy(at_full_speed(cell))),
        *((f"speeds_{count}_modes", energy(with_modes(cell, count))) for count in range(1, most + 1)),
    ):
        found[f"{name}_percent"] = round(100.0 * (1.0 - planned / motors), 2)
        found[f"{name}_over_brakes_percent"] = round(100.0 * (1.0 - planned / brakes), 2)
    return found


if __name__ == "__main__":
    main()
