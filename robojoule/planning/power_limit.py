"""A largest mains power as a constraint of plans: speed limits below which no movement draws more.

The peak power of a movement grows with its speed limit but for ripples, so the limit is the highest whole percent up to
which all whole percents keep within the power.
"""

from __future__ import annotations

import numpy as np

from robojoule.errors import InputError, PlanningError
from robojoule.inputs import as_number
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun
from robojoule.planning.writeback import move_percents
from robojoule.programs.operation_tree import OperationTree

MOST_POWER_W = 1e7
ROUNDING = 1e-9


def check_power_limit(value: object) -> float:
    """A largest mains power that may be asked for. [W]

    Raises:
        InputError: It is not a number, or out of range.
    """
    return as_number(value, "peak_power_w", least=0.0, most=MOST_POWER_W, unit="W")


def within_power(batch: TreeBatch, tree: OperationTree, peak_power_w: float) -> OperationTree:
    """The one tree of a batch with speed limits at which no movement draws more than a power [W].

    Raises:
        InputError: A movement draws more at its least speed; names the least power that is feasible.
    """
    percents = np.arange(max(round(100.0 * batch.slowest_speed_limit), 1), 101)
    graph, moves = batch.graphs[0], {move.name: move for move in tree.moves()}
    powers_w = batch.planned.simulate(np.tile(percents / 100.0, (len(graph.vertices), 1))).peak_power_w
    bounds = np.full(len(graph.vertices), 100.0)
    for place, (vertex, row) in enumerate(zip(graph.vertices, powers_w, strict=True)):
        own = [moves[name] for name in vertex.moves]
        least = min(m.speed_limit_percent if m.fixed else m.least_speed_percent or percents[0] for m in own)
        kept = int(np.argmax(row > peak_power_w)) if (row > peak_power_w).any() else len(row)
        bound = float(percents[kept - 1]) if kept else 0.0
        if bound >= max(move.speed_limit_percent for move in own):
            continue
        if bound < least:
            at = int(np.searchsorted(percents, least))
            drawn_w = float(row[: min(at + 1, len(row))].max())
            what = f"move '{vertex.name}' draws {drawn_w:.0f} W at its least speed limit, {least:g} %"
            raise InputError(what, key="peak_power_w", allowed=f"at least {np.ceil(drawn_w):.0f} W")
        bounds[place] = bound
    of_moves = move_percents(tree, graph, bounds / 100.0)
    return tree.with_plan({name: p for name, p in of_moves.items() if p < moves[name].speed_limit_percent})


def check_power(run: CycleRun, peak_power_w: float) -> None:
    """Refuse a plan that draws more than a power [W].

    Raises:
        InputError: Standing or a process step draws more, which no speed limit changes.
        PlanningError: A movement draws more.
    """
    if run.peak_power_w <= peak_power_w * (1.0 + ROUNDING):
        return
    if run.peak_powers_w.max() <= peak_power_w * (1.0 + ROUNDING):
        problem = f"standing still, process steps included, draws {run.peak_power_w:.0f} W"
        raise InputError(problem, key="peak_power_w", allowed=f"at least {np.ceil(run.peak_power_w):.0f} W")
    raise PlanningError(f"the plan draws {run.peak_power_w:.1f} W, more than {peak_power_w:g} W; ask for a little less")
