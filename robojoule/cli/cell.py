"""`robojoule cell`: plans of whole cells, their check and drawings."""

from __future__ import annotations

import argparse
import math
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import Event, current_thread, main_thread
from typing import TYPE_CHECKING, Any

from robojoule.cli._arguments import check_outputs, number, whole_number
from robojoule.errors import InputError, RobojouleError
from robojoule.inputs import shown

if TYPE_CHECKING:
    from robojoule.formats.robot_cell import RobotCell
    from robojoule.planning.any_plan import AnyPlan
    from robojoule.planning.cells.plan import CellPlan
    from robojoule.planning.robot_cells.cell_run import CellRun
    from robojoule.programs.cell import Cell

_STEPS_SHOWN = 400


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What to do with a cell, and the arguments of that."""
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    solve = actions.add_parser("solve", help="the plan with the least energy", description="The plan of least energy.")
    check = actions.add_parser("check", help="whether a plan is feasible, and its energy", description="Check a plan.")
    gantt = actions.add_parser("gantt", help="a drawing of a plan", description="Draw what each robot does in a cycle.")
    for sub in (solve, check, gantt):
        sub.add_argument("--json", action="store_true", default=argparse.SUPPRESS, help="print one JSON object")
        sub.add_argument("cell", type=Path, metavar="FILE", help="cell file (YAML, JSON) or published benchmark (XML)")
    solve.add_argument("--time-limit", type=number, default=60.0, metavar="S", help="of each cell [s] (default: 60)")
    solve.add_argument(
        "--gap", type=number, metavar="PERCENT", help="proven gap at which to end [%%] (default: 0.01; of robots 0.1)"
    )
    solve.add_argument("--threads", type=whole_number, default=1, metavar="N", help="of the solver (default: 1)")
    solve.add_argument("--seed", type=whole_number, default=0, metavar="N", help="of random choices (default: 0)")
    solve.add_argument("--instance", type=whole_number, metavar="N", help="only this cell of the file, counted from 0")
    solve.add_argument(
        "--profiles", choices=("simulated", "predicted"), help="where energies of robots come from (default: simulated)"
    )
    solve.add_argument(
        "--out", type=Path, metavar="FILE", help="write the plans here (.json, .csv), programs of robots beside it"
    )
    solve.add_argument("--quiet", action="store_true", help="do not tell on a terminal how far the search is")
    for sub in (check, gantt):
        sub.add_argument("plan", type=Path, metavar="PLAN", help="plans (.json, .csv), as `cell solve` writes them")
    gantt.add_argument("--plot", type=Path, required=True, metavar="FILE", help="where to draw (.svg)")
    gantt.add_argument("--cell", dest="name", metavar="NAME", help="which cell, if there are several plans")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Do what is asked for."""
    return {"solve": _solve, "check": _check, "gantt": _gantt}[arguments.action](arguments)


def _solve(arguments: argparse.Namespace) -> dict[str, Any]:
    from robojoule.formats.cells import load_cells
    from robojoule.planning.cells.plan_files import SUFFIXES

    check_outputs(arguments, ["cell"], {"out": SUFFIXES})
    cells = load_cells(arguments.cell)
    if arguments.instance is not None:
        if not 0 <= arguments.instance < len(cells):
            problem = f"the file holds {len(cells)} cells"
            raise InputError(problem, key="--instance", allowed=f"0 to {len(cells) - 1}")
        cells = (cells[arguments.instance],)
    _check_kinds(arguments, cells)
    plans, results = [], []
    with _interrupt() as stopped:
        for cell in cells:
            try:
                plan = _planned(cell, arguments, stopped)
            except RobojouleError as error:
                if len(cells) == 1:
                    raise
                results.append({"cell": cell.name, "status": "failed", "message": str(error)})
                continue
            plans.append(plan)
            results.append(plan.to_dict())
            if stopped.is_set():
                break
    written = _write(cells, plans, arguments.out) if arguments.out is not None and plans else {"out": None}
    return {**(results[0] if len(cells) == 1 else {"instances": results}), **written}


def exit_code(result: dict[str, Any]) -> int:
    """1 where none of several cells has a plan, 2 where a check found a plan that is not feasible."""
    if not result.get("feasible", True):
        return 2
    cells = result.get("instances", [])
    return int(bool(cells) and all(one["status"] == "failed" for one in cells))


def _check_kinds(arguments: argparse.Namespace, cells: Sequence[Cell | RobotCell]) -> None:
    """Refuse options that do not go with the cells, before anything is planned."""
    from robojoule.formats.robot_cell import RobotCell
    from robojoule.planning.robot_cells.plan_files import SUFFIXES, program_paths

    of_robots = [cell for cell in cells if isinstance(cell, RobotCell)]
    if arguments.profiles is not None and not of_robots:
        raise InputError("this cell has its own energies", key="--profiles", allowed="with cells of robots")
    for cell in of_robots:
        if arguments.out is not None:
            check_outputs(arguments, ["cell"], {"out": SUFFIXES})
            program_paths(cell, arguments.out)


def _planned(cell: Cell | RobotCell, arguments: argparse.Namespace, stopped: Event) -> AnyPlan:
    from robojoule.api import optimize

    settings: dict[str, Any] = {
        "time_limit_s": arguments.time_limit,
        "threads": arguments.threads,
        "seed": arguments.seed,
        "stop": stopped.is_set,
    }
    optional = {"gap_percent": arguments.gap, "profiles": arguments.profiles}
    return optimize(cell, **settings, **{name: value for name, value in optional.items() if value is not None})


def _write(cells: Sequence[Cell | RobotCell], plans: Sequence[AnyPlan], out: Path) -> dict[str, Any]:
    """Write plans, and programs beside them where cells have robots."""
    from robojoule.planning.cells.plan import CellPlan
    from robojoule.planning.cells.plan_files import write_plans
    from robojoule.planning.robot_cells.plan import RobotCellPlan
    from robojoule.planning.robot_cells.plan_files import write_robot_plan

    for cell, plan in zip(cells, plans, strict=False):  # a file holds one cell of robots, or cells of the other kind
        if isinstance(plan, RobotCellPlan):
            files = write_robot_plan(cell, plan, out)  # type: ignore[arg-type]
            return {"out": str(out), "programs": [str(file) for file in files]}
    write_plans([plan for plan in plans if isinstance(plan, CellPlan)], out)
    return {"out": str(out)}


def _check(arguments: argparse.Namespace) -> dict[str, Any]:
    from robojoule.planning.cells.check import check_plan

    if (run := _robot_run(arguments)) is not None:
        return {"feasible": run[1].feasible, "plans": [run[1].to_dict()]}
    results = []
    for cell, plan in _plans(arguments):
        check = check_plan(cell, plan)
        results.append(
            {
                "cell": plan.cell,
                "feasible": check.feasible,
                "energy_j": check.energy_j if math.isfinite(check.energy_j) else None,
                "violations": list(check.violations),
            }
        )
    return {"feasible": all(one["feasible"] for one in results), "plans": results}


def _gantt(arguments: argparse.Namespace) -> dict[str, Any]:
    from robojoule.documents import write_text
    from robojoule.planning.cells.check import check_plan
    from robojoule.planning.robot_cells.drawn import as_drawn
    from robojoule.plots.gantt import drawing_of

    check_outputs(arguments, ["cell", "plan"], {"plot": [".svg"]})
    if (run := _robot_run(arguments)) is not None:
        if run[1].violations:
            raise InputError(f"the plan is not feasible: {run[1].violations[0]}", file=arguments.plan)
        cell, plan = as_drawn(*run)
    else:
        pairs = [pair for pair in _plans(arguments) if arguments.name in (None, pair[0].name)]
        if len(pairs) != 1:
            problem = f"{len(pairs)} plans of the file are meant"
            raise InputError(problem, file=arguments.plan, allowed="one, named by --cell where there are several")
        cell, plan = pairs[0]
        if (check := check_plan(cell, plan)).violations:
            raise InputError(f"the plan is not feasible: {check.violations[0]}", file=arguments.plan)
    write_text(arguments.plot, drawing_of(cell, plan))
    return {"cell": cell.name, "plot": str(arguments.plot)}


def _robot_run(arguments: argparse.Namespace) -> tuple[RobotCell, CellRun] | None:
    """A cell of robots with the simulation of its plan; none for a cell of the other kind."""
    from robojoule.formats.cells import load_cells
    from robojoule.formats.robot_cell import RobotCell

    cell = load_cells(arguments.cell)[0]
    if not isinstance(cell, RobotCell):
        return None
    from robojoule.planning.robot_cells.plan_files import simulate_plan_file

    return cell, simulate_plan_file(cell, arguments.plan)


def _plans(arguments: argparse.Namespace) -> list[tuple[Cell, CellPlan]]:
    """The plans of the file with their cells."""
    from robojoule.formats.cells import load_cells
    from robojoule.planning.cells.plan_files import read_plans
    from robojoule.programs.cell import Cell

    cells = {cell.name: cell for cell in load_cells(arguments.cell) if isinstance(cell, Cell)}
    plans = read_plans(arguments.plan)
    for plan in plans:
        if plan.cell not in cells:
            raise InputError(
                f"the plan is for cell {shown(plan.cell)}", file=arguments.plan, allowed=", ".join(list(cells)[:20])
            )
    return [(cells[plan.cell], plan) for plan in plans]


@contextmanager
def _interrupt() -> Iterator[Event]:
    """Ctrl-C ends the search with its best plan; a second one ends the command."""
    stopped = Event()
    if current_thread() is not main_thread():
        yield stopped
        return

    def note(*_: object) -> None:
        if stopped.is_set():
            raise KeyboardInterrupt
        stopped.set()

    before = signal.signal(signal.SIGINT, note)
    try:
        yield stopped
    finally:
        signal.signal(signal.SIGINT, before)


def show(result: dict[str, Any]) -> None:
    """Print plans, or what the check found."""
    if "plot" in result:
        print(f"written to {result['plot']}")
        return
    if "plans" in result:
        for one in result["plans"]:
            energy = "unknown energy" if one["energy_j"] is None else f"{one['energy_j']:.2f} J"
            print(f"{one['cell']}: {'feasible' if one['feasible'] else 'not feasible'}, {energy}")
            for violation in one["violations"]:
                print(f"  {violation}")
        return
    for one in result.get("instances", [result]):
        if "message" in one:
            print(f"{one['cell']}: {one['message']}")
            continue
        print(
            f"{one['cell']}: {one['status']}, {one['energy_j']:.2f} J per cycle of {one['cycle_time_s']:.4f} s, "
            f"bound {one['bound_j']:.2f} J, gap {one['gap_percent']:.4f} %, {one['runtime_s']:.2f} s"
        )
        if "largest_mean_power_w" in one:
            print(
                f"largest power of all robots {one['largest_mean_power_w']:.0f} W, each movement at its mean: "
                "energy functions tell no peaks and no torques"
            )
        if "instances" not in result:
            _show_robots(one)
            _show_steps(one["steps"])
    if result["out"]:
        print(f"written to {', '.join([result['out'], *result.get('programs', [])])}")


def _show_robots(plan: dict[str, Any]) -> None:
    """Print what the simulation of all robots says."""
    if "saving_percent" not in plan:
        return
    near = "" if plan["clearance_m"] is None else f", robots keep {plan['clearance_m']:.3f} m"
    print(
        f"{plan['saving_percent']:.1f} % less than the programs as given, largest power {plan['peak_power_w']:.0f} W"
        f"{near}"
    )
    for warning in plan["warnings"]:
        print(f"warning: {warning}")


def _show_steps(steps: list[dict[str, Any]]) -> None:
    """Print the activities as a table."""
    names = {"robot": "robot", "activity": "activity", "option": "location or movement", "mode": "mode"}
    width = {
        name: max(len(title), *(len(step[name] or "") for step in steps[:_STEPS_SHOWN]), 0)
        for name, title in names.items()
    }
    print("  ".join(f"{title:{width[name]}}" for name, title in names.items()), " start [s]  duration [s]  energy [J]")
    for step in steps[:_STEPS_SHOWN]:
        words = "  ".join(f"{step[name] or '':{width[name]}}" for name in names)
        print(f"{words}   {step['start_s']:9.4f}  {step['duration_s']:12.4f}  {step['energy_j']:10.1f}")
    if len(steps) > _STEPS_SHOWN:
        print(f"... and {len(steps) - _STEPS_SHOWN} more")
