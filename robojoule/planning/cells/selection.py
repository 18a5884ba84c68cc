"""What a plan has decided before its times: the order, locations, movements and power modes of each robot."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from robojoule.arrays import Array, Index
from robojoule.planning.cells.model import CellModel
from robojoule.planning.cells.numbering import Numbering
from robojoule.planning.cells.plan import CellPlan, Step


@dataclass(frozen=True, eq=False)
class Selection:
    """Movements and stays of each robot in order, from the start of its cycle; the last stay is that of h_r.

    Attributes:
        movements: For each planned robot, the movements.
        stays: For each planned robot, the stay after each movement.
    """

    movements: dict[int, Index]
    stays: dict[int, Index]

    @property
    def key(self) -> tuple[tuple[int, ...], ...]:
        """The choices as something to compare."""
        return tuple((*self.movements[r].tolist(), -1, *self.stays[r].tolist()) for r in sorted(self.movements))


def selection_of(model: CellModel, values: Array) -> Selection:
    """The choices in a solution of a model."""
    n = model.numbers
    done = model.movements[values[model.y[model.movements]] > 0.5]
    by_tail = {int(n.tail[n.movement_dynamic[t]]): int(t) for t in done}
    stays = model.stays[values[model.u[model.stays]] > 0.5]
    stay_at = {int(n.stay_static[s]): int(s) for s in stays}
    movements: dict[int, Index] = {}
    chosen: dict[int, Index] = {}
    for r in sorted(model.parts.robots):
        place, moving, standing = int(n.last[r]), [], []
        for _ in range(int((n.static_robot == r).sum())):
            moving.append(by_tail[place])
            place = int(n.head[n.movement_dynamic[moving[-1]]])
            standing.append(stay_at[place])
        movements[r], chosen[r] = np.array(moving), np.array(standing)
    return Selection(movements, chosen)


@dataclass(frozen=True, eq=False)
class Times:
    """Times of a selection.

    Attributes:
        phases_s: Start of each planned robot's cycle. [s]
        moves_s: Duration of each movement, robot by robot. [s]
        stays_s: Duration of each stay, robot by robot. [s]
    """

    phases_s: dict[int, float]
    moves_s: dict[int, Array]
    stays_s: dict[int, Array]

    def exact(self, numbers: Numbering, selection: Selection) -> Times:
        """Durations within their windows that sum to the cycle time: what the solver's tolerances left is settled."""
        moves, stays = {}, {}
        for r, t in selection.movements.items():
            s = selection.stays[r]
            low = np.concatenate([numbers.d_min_s[t], numbers.stay_least_s[s]])
            high = np.concatenate([numbers.d_max_s[t], numbers.stay_longest_s[s]])
            durations = np.clip(np.concatenate([self.moves_s[r], self.stays_s[r]]), low, high)
            missing = numbers.cycle_time_s - float(durations.sum())
            room = (high if missing > 0.0 else low) - durations
            widest = np.argsort(-np.abs(room), kind="stable")
            for i in widest:
                step = float(np.clip(missing, min(room[i], 0.0), max(room[i], 0.0)))
                durations[i] += step
                missing -= step
            moves[r], stays[r] = durations[: t.size], durations[t.size :]
        return Times(self.phases_s, moves, stays)


def energy_j(numbers: Numbering, selection: Selection, times: Times) -> float:
    """True energy of a selection at given times. [J]"""
    return sum(
        float(numbers.energies_j(t, times.moves_s[r]).sum())
        + float(numbers.stay_power_w[selection.stays[r]] @ times.stays_s[r])
        for r, t in selection.movements.items()
    )


def plan_of(
    numbers: Numbering, selection: Selection, times: Times, status: str, bound_j: float, runtime_s: float
) -> CellPlan:
    """The plan of all robots, in words."""
    cell, steps = numbers.cell, []
    for r, robot in enumerate(cell.robots):
        t, s = selection.movements[r], selection.stays[r]
        durations = np.stack([times.moves_s[r], times.stays_s[r]], axis=1).ravel()
        starts = times.phases_s[r] + np.concatenate([[0.0], np.cumsum(durations)[:-1]])
        moving = numbers.energies_j(t, times.moves_s[r])
        standing = numbers.stay_power_w[s] * times.stays_s[r]
        for i in range(t.size):
            movement, stay = int(t[i]), int(s[i])
            steps.append(
                Step(
                    robot.name,
                    numbers.dynamic_names[numbers.movement_dynamic[movement]],
                    numbers.movement_names[movement],
                    None,
                    *(float(value) for value in (starts[2 * i], durations[2 * i], moving[i])),
                )
            )
            steps.append(
                Step(
                    robot.name,
                    numbers.static_names[numbers.stay_static[stay]],
                    numbers.location_names[numbers.stay_location[stay]],
                    robot.modes[numbers.stay_mode[stay]].name,
                    *(float(value) for value in (starts[2 * i + 1], durations[2 * i + 1], standing[i])),
                )
            )
    return CellPlan(cell.name, cell.cycle_time_s, tuple(steps), status, bound_j, runtime_s)


def poses_fit(numbers: Numbering, selection: Selection) -> bool:
    """Whether the locations of every hand-over between planned robots fit together."""
    chosen = {
        int(numbers.stay_static[s]): int(numbers.stay_location[s]) for stays in selection.stays.values() for s in stays
    }
    return all(
        v not in chosen or w not in chosen or (chosen[v], chosen[w]) in pairs for v, w, pairs in numbers.handovers
    )


def is_whole(numbers: Numbering, selection: Selection) -> bool:
    """Whether every robot's movements and stays join to one closed tour."""
    for r, t in selection.movements.items():
        places = numbers.stay_location[selection.stays[r]]
        if (numbers.movement_end[t] != places).any() or (numbers.movement_start[t] != np.roll(places, 1)).any():
            return False
        visited = numbers.stay_static[selection.stays[r]]
        if any(a == b for a, b in pairwise(np.sort(visited))) or visited[-1] != numbers.last[r]:
            return False
    return True
