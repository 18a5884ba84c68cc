"""The optimum of a tiny cell by trying everything: independent of the models, the numbering and HiGHS."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
from scipy.optimize import LinearConstraint, minimize

from robojoule.programs.cell import Cell, CellRobot, Movement

Tour = list[tuple[str, Movement, str, str, str]]  # dynamic activity, movement, static activity, location, mode


def tours(robot: CellRobot) -> Iterator[Tour]:
    """Every order, pose and mode of a robot, from the movement that leaves its last activity."""
    names = [one.name for one in robot.static if one.name != robot.last]
    static = {one.name: one for one in robot.static}
    arcs = {(one.start, one.end): one for one in robot.dynamic}
    for order in itertools.permutations(names):
        circle = [*order, robot.last]
        pairs = list(zip([robot.last, *order], circle, strict=True))
        if not all(pair in arcs for pair in pairs):
            continue
        for places in itertools.product(*([p.name for p in static[v].locations] for v in circle)):
            moves = []
            for pair, start, end in zip(pairs, [places[-1], *places[:-1]], places, strict=True):
                found = [m for m in arcs[pair].movements if (m.start, m.end) == (start, end)]
                moves.append(found[0] if found else None)
            if None in moves:
                continue
            for modes in itertools.product([m.name for m in robot.modes], repeat=len(circle)):
                yield [
                    (arcs[pair].name, move, v, place, mode)
                    for pair, move, v, place, mode in zip(pairs, moves, circle, places, modes, strict=True)
                ]


def optimum_j(cell: Cell) -> float:
    """Least energy of a cell with two robots. [J]"""
    best = math.inf
    for pair in itertools.product(*(list(tours(robot)) for robot in cell.robots)):
        best = min(best, _least_j(cell, pair, best))
    return best


def _least_j(cell: Cell, pair: tuple[Tour, ...], best: float) -> float:
    """Least energy for given choices: a smooth convex problem for each whole number of cycles of each collision."""
    chosen = {}
    durations: list[tuple[float, float]] = []
    energy: list[object] = []
    starts: dict[str, np.ndarray] = {}
    count = 2 * sum(len(tour) for tour in pair)
    rows, low, high = [], [], []
    place = 0
    for r, (robot, tour) in enumerate(zip(cell.robots, pair, strict=True)):
        idle = {mode.name: mode.least_idle_s for mode in robot.modes}
        static = {one.name: one for one in robot.static}
        at = np.zeros(count + 1)  # start as a row over the durations and the second robot's phase
        at[-1] = float(r)
        begin = place
        for name, move, v, location, mode in tour:
            chosen[name], chosen[v] = move.name, location
            starts[name] = at.copy()
            at[place] += 1.0
            starts[v] = at.copy()
            at[place + 1] += 1.0
            durations += [
                (move.profile.d_min_s, move.profile.d_max_s),
                (max(static[v].least_s, idle[mode]), static[v].longest_s),
            ]
            power = next(p for p in static[v].locations if p.name == location).powers_w[mode]
            energy += [move.profile, power]
            place += 2
        total = np.zeros(count + 1)
        total[begin:place] = 1.0
        rows.append(total)
        low.append(cell.cycle_time_s)
        high.append(cell.cycle_time_s)
    if any(a > b for a, b in durations):
        return math.inf
    if any((chosen[h.first], chosen[h.second]) not in h.pairs for h in cell.handovers):
        return math.inf
    for lag in cell.lags:
        if lag.first in starts and lag.second in starts:
            rows.append(starts[lag.second] - starts[lag.first])
            low.append(lag.length_s - cell.cycle_time_s * lag.cycles)
            high.append(math.inf)
    meeting = [c for c in cell.collisions if all(chosen.get(e.activity) == e.option for e in c)]
    lasting = {name: int(np.flatnonzero(starts[name] != starts[after])[0]) for name, after in _following(pair, starts)}
    for cycles in itertools.product(range(-2, 3), repeat=len(meeting)):
        more, floor, ceiling = list(rows), list(low), list(high)
        for one, k in zip(meeting, cycles, strict=True):
            apart = starts[one.second.activity] - starts[one.first.activity]
            for sign, name, value in (
                (1.0, one.first.activity, -k * cell.cycle_time_s),
                (-1.0, one.second.activity, (k - 1) * cell.cycle_time_s),
            ):
                row = sign * apart
                row[lasting[name]] -= 1.0
                more.append(row)
                floor.append(value)
                ceiling.append(math.inf)
        best = min(best, _solve(energy, durations, np.array(more), floor, ceiling, cell.cycle_time_s, best))
    return best


def _following(pair: tuple[Tour, ...], starts: dict[str, np.ndarray]) -> Iterator[tuple[str, str]]:
    for tour in pair:
        names = [name for step in tour for name in (step[0], step[2])]
        yield from itertools.pairwise(names)


def _solve(energy, durations, rows, low, high, cycle_time_s, best) -> float:
    powers = np.array([one if isinstance(one, float) else 0.0 for one in energy])
    moving = [(i, one) for i, one in enumerate(energy) if not isinstance(one, float)]

    def value(x):
        return float(powers @ x[:-1] + sum(float(one.value(x[i])) for i, one in moving))

    def slope(x):
        found = np.append(powers, 0.0)
        for i, one in moving:
            found[i] = float(one.marginal_power_w(x[i]))
        return found

    bound = sum(float(one.value(one.duration_at(0.0))) for _, one in moving)
    bound += float(powers @ [low for low, _ in durations])
    if bound >= best:
        return math.inf
    low, high = np.array(low), np.array(high)
    equal = low == high
    x0 = np.array([0.5 * (a + min(b, a + 2.0)) for a, b in durations] + [0.0])
    bounds = [*durations, (-2.0 * cycle_time_s, 2.0 * cycle_time_s)]
    found = minimize(
        value,
        x0,
        jac=slope,
        bounds=bounds,
        constraints=[LinearConstraint(rows[equal], low[equal], low[equal])]
        + [LinearConstraint(rows[~equal], low[~equal], np.inf)] * (not equal.all()),
        method="SLSQP",
        options={"maxiter": 300, "ftol": 1e-10},
    )
    gap = np.maximum(low - rows @ found.x, rows @ found.x - high).max()
    return float(found.fun) if found.success and gap < 1e-6 else math.inf
