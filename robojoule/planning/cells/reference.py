"""The planning model of a cell in Pyomo, by names: the text of `robojoule.planning.cells.model` line by line.

It is written to be read and to be held against the direct model, which is built some ten times faster and which the
searches use. Both have the same sets, variables and constraint families, numbered alike, and nothing else in common:
this one knows the cell alone. Energies are tangents at given durations, equal for every movement.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np
import pyomo.environ as pyo

from robojoule.programs.cell import Cell, Choice, Movement


def build_model(cell: Cell, tangents: int = 8) -> pyo.ConcreteModel:
    """Build the model of a cell.

    Args:
        cell: The cell.
        tangents: Tangents of each movement, at equal steps of its window.

    Returns:
        Model with the objective `energy`; a lower bound of the true one, as tangents are. [J]
    """
    model = pyo.ConcreteModel(cell.name)
    _add_sets(model, cell)
    _add_variables(model, cell)
    _add_choices(model, cell)
    _add_stays(model, cell)
    _add_movements(model, cell)
    _add_energies(model, cell, tangents)
    _add_clock(model, cell)
    _add_lags(model, cell)
    _add_handovers(model, cell)
    _add_meetings(model, cell)
    standing = sum(_power_w(cell, s) * model.delta[s] for s in model.S)
    model.energy = pyo.Objective(expr=standing + sum(model.W[t] for t in model.T), sense=pyo.minimize)
    return model


def _add_sets(model: pyo.ConcreteModel, cell: Cell) -> None:
    """R, V, E by names; stays (v, l, m) that can be chosen; movements (e, t)."""
    model.R = pyo.Set(initialize=[robot.name for robot in cell.robots])
    model.V = pyo.Set(initialize=list(cell.static))
    model.E = pyo.Set(initialize=list(cell.dynamic))
    stays = [
        (v.name, place.name, mode.name)
        for robot in cell.robots
        for v in robot.static
        for place in v.locations
        for mode in robot.modes
        if mode.least_idle_s <= v.longest_s
    ]
    model.S = pyo.Set(initialize=stays, dimen=3)
    model.T = pyo.Set(initialize=[(e.name, t.name) for e in cell.dynamic.values() for t in e.movements], dimen=2)
    model.last = pyo.Set(initialize=[robot.last for robot in cell.robots])


def _add_variables(model: pyo.ConcreteModel, cell: Cell) -> None:
    """Choices, durations, energies, clock, phases."""
    CT, reach = cell.cycle_time_s, _reach_s(cell)
    model.u = pyo.Var(model.S, domain=pyo.Binary)
    model.delta = pyo.Var(model.S, bounds=(0.0, None))
    model.y = pyo.Var(model.T, domain=pyo.Binary)
    model.d = pyo.Var(model.T, bounds=(0.0, None))
    model.W = pyo.Var(model.T, bounds=(0.0, None))
    model.f = pyo.Var(model.E, bounds=lambda _, e: (0.0, 0.0 if cell.dynamic[e].start in model.last else CT))
    first = cell.robots[0].name
    model.t = pyo.Var(model.R, bounds=lambda _, r: (0.0, 0.0) if r == first else (-reach, reach))


def _add_choices(model: pyo.ConcreteModel, cell: Cell) -> None:
    """(1) one stay for each static activity, (2) a path through the locations."""
    model.choice = pyo.Constraint(
        model.V, rule=lambda m, v: sum(_x(m, cell, v, place.name) for place in cell.static[v].locations) == 1
    )
    places = [(v.name, place.name) for v in cell.static.values() for place in v.locations]
    leaving: dict[Choice, list[tuple[str, str]]] = {Choice(*place): [] for place in places}
    entering: dict[Choice, list[tuple[str, str]]] = {Choice(*place): [] for place in places}
    for e in cell.dynamic.values():
        for t in e.movements:
            leaving[Choice(e.start, t.start)].append((e.name, t.name))
            entering[Choice(e.end, t.end)].append((e.name, t.name))
    model.out = pyo.Constraint(
        places, rule=lambda m, v, p: pyo.quicksum(m.y[t] for t in leaving[Choice(v, p)]) == _x(m, cell, v, p)
    )
    model.into = pyo.Constraint(
        places, rule=lambda m, v, p: pyo.quicksum(m.y[t] for t in entering[Choice(v, p)]) == _x(m, cell, v, p)
    )


def _add_stays(model: pyo.ConcreteModel, cell: Cell) -> None:
    """(3) windows of stays, minimal idle times included."""
    idle = {(robot.name, mode.name): mode.least_idle_s for robot in cell.robots for mode in robot.modes}

    def least(v: str, mode: str) -> float:
        return max(cell.static[v].least_s, idle[cell.robot_of[v], mode])

    model.stay_least = pyo.Constraint(model.S, rule=lambda m, v, p, q: m.delta[v, p, q] >= least(v, q) * m.u[v, p, q])
    model.stay_longest = pyo.Constraint(
        model.S, rule=lambda m, v, p, q: m.delta[v, p, q] <= cell.static[v].longest_s * m.u[v, p, q]
    )


def _add_movements(model: pyo.ConcreteModel, cell: Cell) -> None:
    """(4) windows of movements."""
    profiles = {(e.name, t.name): t.profile for e in cell.dynamic.values() for t in e.movements}
    model.move_least = pyo.Constraint(model.T, rule=lambda m, e, t: m.d[e, t] >= profiles[e, t].d_min_s * m.y[e, t])
    model.move_longest = pyo.Constraint(model.T, rule=lambda m, e, t: m.d[e, t] <= profiles[e, t].d_max_s * m.y[e, t])


def _add_energies(model: pyo.ConcreteModel, cell: Cell, tangents: int) -> None:
    """(5) tangents in perspective form."""
    model.tangents = pyo.ConstraintList()
    for e in cell.dynamic.values():
        for t in e.movements:
            for slope, offset in tangents_of(t, tangents):
                model.tangents.add(
                    model.W[e.name, t.name] >= slope * model.d[e.name, t.name] + offset * model.y[e.name, t.name]
                )


def tangents_of(movement: Movement, count: int) -> Iterator[tuple[float, float]]:
    """Slope [W] and offset [J] of tangents of a movement's energy, at equal steps of its window."""
    profile = movement.profile
    for duration in np.linspace(profile.d_min_s, profile.d_max_s, count).tolist():
        slope = float(profile.marginal_power_w(duration))
        yield slope, float(profile.value(duration)) - slope * duration


def _add_clock(model: pyo.ConcreteModel, cell: Cell) -> None:
    """(6) the time since the start of the cycle flows along the tour."""
    CT = cell.cycle_time_s
    model.clock_done = pyo.Constraint(
        model.E, rule=lambda m, e: m.f[e] <= CT * sum(m.y[e, t.name] for t in cell.dynamic[e].movements)
    )

    def flow(m: pyo.ConcreteModel, v: str) -> object:
        stays = sum(m.delta[s] for s in m.S if s[0] == v)
        if v in m.last:
            return _arrival(m, cell, v) + stays == CT
        return _arrival(m, cell, v) + stays == pyo.quicksum(m.f[e.name] for e in cell.leaving(v))

    model.clock = pyo.Constraint(model.V, rule=flow)


def _add_lags(model: pyo.ConcreteModel, cell: Cell) -> None:
    """(7) time lags; that of an optional activity holds where it is done."""
    CT = cell.cycle_time_s
    far = 2.0 * _reach_s(cell) + CT

    def not_done(m: pyo.ConcreteModel, name: str) -> Any:
        if name in cell.static or len(cell.leaving(cell.dynamic[name].start)) == 1:
            return 0.0
        return 1 - sum(m.y[name, t.name] for t in cell.dynamic[name].movements)

    def lag(m: pyo.ConcreteModel, number: int) -> object:
        one = cell.lags[number]
        slack = (far + abs(one.length_s) + CT * abs(one.cycles)) * (not_done(m, one.first) + not_done(m, one.second))
        return _start(m, cell, one.second) - _start(m, cell, one.first) >= one.length_s - CT * one.cycles - slack

    model.lags = pyo.Constraint(range(len(cell.lags)), rule=lag)


def _add_handovers(model: pyo.ConcreteModel, cell: Cell) -> None:
    """(8) locations that fit, both ways."""
    model.handovers = pyo.ConstraintList()
    for one in cell.handovers:
        for side, (v, w) in enumerate([(one.first, one.second), (one.second, one.first)]):
            for place in cell.static[v].locations:
                fitting = {pair[1 - side] for pair in one.pairs if pair[side] == place.name}
                others = pyo.quicksum(_x(model, cell, w, other) for other in sorted(fitting))
                model.handovers.add(_x(model, cell, v, place.name) - others <= 0)


def _add_meetings(model: pyo.ConcreteModel, cell: Cell) -> None:
    """(9) choices that collide are apart in every cycle; one integer for each pair of activities."""
    CT, reach = cell.cycle_time_s, int(2.0 * _reach_s(cell) / cell.cycle_time_s) + 2
    pairs = sorted({(one.first.activity, one.second.activity) for one in cell.collisions})
    model.k = pyo.Var(range(len(pairs)), domain=pyo.Integers, bounds=(-reach, reach))
    model.apart = pyo.ConstraintList()
    for number, (a, b) in enumerate(pairs):
        between = _start(model, cell, b) + CT * model.k[number] - _start(model, cell, a)
        choices = {(x.option, y.option) for x, y in cell.collisions if (x.activity, y.activity) == (a, b)}
        for i, j in product(sorted({i for i, _ in choices}), sorted({j for _, j in choices})):
            if (i, j) not in choices:
                continue
            (lasting_a, longest_a), (lasting_b, longest_b) = _lasting(model, cell, a, i), _lasting(model, cell, b, j)
            model.apart.add(between >= lasting_a - longest_a * (1 - _taken(model, cell, b, j)))
            model.apart.add(CT - between >= lasting_b - longest_b * (1 - _taken(model, cell, a, i)))


def _reach_s(cell: Cell) -> float:
    """By how much two robots' cycles need to start apart at most: whole cycles more can be taken off. [s]"""
    CT = cell.cycle_time_s
    longest = max((abs(one.length_s - CT * one.cycles) for one in cell.lags), default=0.0)
    return max(len(cell.robots) - 1, 1) * (2.0 * CT + longest)


def _x(m: pyo.ConcreteModel, cell: Cell, v: str, place: str) -> Any:
    """Whether a location is chosen."""
    robot = next(one for one in cell.robots if one.name == cell.robot_of[v])
    return pyo.quicksum(m.u[v, place, mode.name] for mode in robot.modes if (v, place, mode.name) in m.S)


def _arrival(m: pyo.ConcreteModel, cell: Cell, v: str) -> Any:
    """Start of a static activity since the start of its robot's cycle."""
    entering = [e for e in cell.dynamic.values() if e.end == v]
    return sum(m.f[e.name] + sum(m.d[e.name, t.name] for t in e.movements) for e in entering)


def _start(m: pyo.ConcreteModel, cell: Cell, name: str) -> Any:
    """Start of an activity: a dynamic one starts when the static one before it ends."""
    phase = m.t[cell.robot_of[name]]
    if name in cell.static:
        return phase + _arrival(m, cell, name)
    return phase + pyo.quicksum(m.f[e.name] for e in cell.leaving(cell.dynamic[name].start))


def _taken(m: pyo.ConcreteModel, cell: Cell, name: str, option: str) -> Any:
    """Whether a choice is taken."""
    return _x(m, cell, name, option) if name in cell.static else m.y[name, option]


def _lasting(m: pyo.ConcreteModel, cell: Cell, name: str, option: str) -> tuple[Any, float]:
    """Duration of a choice, 0 unless it is taken, and its largest. [s]"""
    if name in cell.dynamic:
        profile = next(t.profile for t in cell.dynamic[name].movements if t.name == option)
        return m.d[name, option], min(profile.d_max_s, cell.cycle_time_s)
    stays = pyo.quicksum(m.delta[s] for s in m.S if s[:2] == (name, option))
    return stays, min(cell.static[name].longest_s, cell.cycle_time_s)


def _power_w(cell: Cell, stay: tuple[str, str, str]) -> float:
    v, place, mode = stay
    return next(one for one in cell.static[v].locations if one.name == place).powers_w[mode]
