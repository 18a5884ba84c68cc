"""Plans of large cells with seeds on Prefect's task runners, Dask's and Ray's. `python -m flows.cells --help`.

The search takes any executor of `concurrent.futures`; this one makes a task of a runner of every call.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from prefect import flow

from flows.command import told
from flows.executor import TaskExecutor
from flows.runners import add_runner, task_runner
from flows.server import prefect_server
from reproduction.layout import Layout
from robojoule.errors import InputError
from robojoule.formats.cells import load_cells
from robojoule.planning.cells.plan import CellPlan
from robojoule.planning.cells.plan_files import check_plan_file, write_plans
from robojoule.planning.cells.solve import GAP_PERCENT, TIME_LIMIT_S, solve_cell
from robojoule.programs.cell import Cell


@flow(name="plan-cell", persist_result=False)
def search(cell: Cell, time_limit_s: float, gap_percent: float, seeds: int, seed: int) -> CellPlan:
    """Plan a cell with some seeds at once on this flow's task runner."""
    return solve_cell(
        cell, time_limit_s=time_limit_s, gap_percent=gap_percent, threads=seeds, seed=seed, executor=TaskExecutor()
    )


def plan_cell(
    cell: Cell,
    *,
    time_limit_s: float = TIME_LIMIT_S,
    gap_percent: float = GAP_PERCENT,
    seeds: int = 2,
    seed: int = 0,
    runner: str = "processes",
    address: str | None = None,
) -> CellPlan:
    """Plan a cell with some seeds at once.

    Args:
        cell: The cell.
        time_limit_s: See `robojoule.planning.cells.solve.solve_cell`. [s]
        gap_percent: See there. [%]
        seeds: Number of seeds at once, and of processes or threads here.
        seed: First of them.
        runner: Task runner: processes, threads, dask or ray.
        address: Address of a Dask or Ray cluster; a temporary one on this machine if not given.

    Raises:
        InputError: Bad runner, or see `solve_cell`.
    """
    tasks = task_runner(runner, seeds, address)
    chosen = search.with_options(task_runner=tasks)
    return chosen(cell, time_limit_s, gap_percent, seeds, seed)


def searched_cells(path: Path) -> list[Cell]:
    """The cells of a file.

    Raises:
        InputError: See `load_cells`; or one is a cell of robots, which another command plans.
    """
    cells = []
    for cell in load_cells(path):
        if not isinstance(cell, Cell):
            raise InputError("this cell is of robots' programs: use `robojoule cell`", file=path)
        cells.append(cell)
    return cells


def main() -> None:
    """Plan the cells of a file from the command line."""
    parser = argparse.ArgumentParser(prog="python -m flows.cells", description=__doc__.splitlines()[0])
    parser.add_argument("cell", type=Path, metavar="FILE", help="cell file or published benchmark")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="write the plans here (.json, .csv)")
    parser.add_argument("--time-limit", type=float, default=TIME_LIMIT_S, metavar="S", help="of each cell [s]")
    parser.add_argument("--gap", type=float, default=GAP_PERCENT, metavar="PERCENT", help="at which to end [%%]")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="the first one (default: 0)")
    add_runner(parser, "processes")  # as many seeds at once as there are workers
    arguments = parser.parse_args()
    with told("flows.cells"):
        check_plan_file(arguments.out)
        cells = searched_cells(arguments.cell)
        task_runner(arguments.runner, arguments.workers, arguments.address)  # refused before a server is started
        with prefect_server(Layout()):
            plans = [
                plan_cell(
                    cell,
                    time_limit_s=arguments.time_limit,
                    gap_percent=arguments.gap,
                    seeds=arguments.workers,
                    seed=arguments.seed,
                    runner=arguments.runner,
                    address=arguments.address,
                )
                for cell in cells
            ]
        write_plans(plans, arguments.out)


if __name__ == "__main__":
    main()
