"""Better plans near a plan: the model of the cell with most choices held, solved from the plan.

Kinds of neighbourhoods: the tours held and poses, modes and the order of collisions free, for all robots or some; one
robot free and poses of its partners; everything free where the cell is small.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from robojoule.arrays import Index
from robojoule.planning.cells.linear import Limits
from robojoule.planning.cells.model import CellModel
from robojoule.planning.cells.numbering import Numbering
from robojoule.planning.cells.selection import Selection, selection_of
from robojoule.planning.cells.tangents import spread_durations_s
from robojoule.planning.cells.timing import Timing, best_times

TANGENTS = 7
SECONDS = 20.0  # of one neighbourhood
FEW_ROBOTS = 5  # up to which all may be free
GAP = 5e-5


@dataclass(frozen=True)
class Neighbourhood:
    """What may change.

    Attributes:
        free: Robots whose tours may change.
        posed: Robots whose poses and modes may change.
    """

    free: frozenset[int]
    posed: frozenset[int]


class Neighbourhoods:
    """Neighbourhoods of plans of one cell, by one model that is kept.

    Args:
        numbers: The cell.
    """

    def __init__(self, numbers: Numbering) -> None:
        self.numbers = numbers
        self.model = CellModel(numbers)
        for at in spread_durations_s(numbers, self.model.movements, TANGENTS):
            self.model.add_tangents(self.model.movements, at)

    def draw(self, rng: np.random.Generator, exhausted: Collection[Neighbourhood]) -> Neighbourhood | None:
        """A neighbourhood that was not searched since the last better plan; none if all were."""
        R = self.numbers.robots
        everyone = frozenset(range(R))
        first = Neighbourhood(frozenset(), everyone)
        if first not in exhausted:
            return first
        kinds = []
        for r in range(R):
            partners = self.partners(r)
            kinds.append(Neighbourhood(frozenset([r]), frozenset([r, *partners[:2]])))
        if R <= FEW_ROBOTS:
            kinds.append(Neighbourhood(everyone, everyone))
        for _ in range(R):
            chosen = frozenset(rng.choice(R, min(4, R), replace=False).tolist())
            kinds.append(Neighbourhood(frozenset(), chosen))
            chosen = frozenset(rng.choice(R, min(2, R), replace=False).tolist())
            kinds.append(Neighbourhood(chosen, chosen))
        open_ = [kind for kind in kinds if kind not in exhausted]
        return open_[int(rng.integers(len(open_)))] if open_ else None

    def partners(self, r: int) -> list[int]:
        """Other robots by how much joins them to one, the most first."""
        n, counts = self.numbers, np.zeros(self.numbers.robots)
        for lag in n.lags:
            pair = int(n.static_robot[lag.first]), int(n.static_robot[lag.second])
            if r in pair:
                counts[pair[0] + pair[1] - r] += 1
        for meeting in n.meetings:
            pair = n.robot_of(meeting.first), n.robot_of(meeting.second)
            if r in pair:
                counts[pair[0] + pair[1] - r] += 1
        return [int(other) for other in np.argsort(-counts, kind="stable") if counts[other] > 0]

    def search(
        self, around: Neighbourhood, selection: Selection, timing: Timing, limits: Limits
    ) -> tuple[Selection, Timing] | None:
        """A better plan in a neighbourhood, if there is one."""
        for r, t in selection.movements.items():
            self.model.add_tangents(t, timing.times.moves_s[r])
        held = self._held(around, selection)
        found = self.model.program.solve(
            replace(limits, gap=GAP),
            start=self.model.values_of(selection, timing),
            fixed=(held, np.zeros(held.size)),
        )
        if found.values is None or found.objective > timing.energy_j - 0.01:
            return None
        better = selection_of(self.model, found.values)
        times = best_times(self.numbers, self.model.parts, better, replace(limits, gap=1e-6))
        if times is None or times.energy_j > timing.energy_j - 0.01:
            return None
        return better, times

    def _held(self, around: Neighbourhood, selection: Selection) -> Index:
        """Columns of choices that a neighbourhood leaves at zero."""
        n, model = self.numbers, self.model
        columns: list[Index] = []
        for r in range(n.robots):
            if r in around.free:
                continue
            t, s = selection.movements[r], selection.stays[r]
            own = n.dynamic_robot[n.movement_dynamic] == r
            if r in around.posed:
                others = own & ~np.isin(n.movement_dynamic, n.movement_dynamic[t])
            else:
                others = own & ~np.isin(np.arange(n.movements), t)
                stays = (n.static_robot[n.stay_static] == r) & ~np.isin(np.arange(n.stays), s)
                columns += [model.u[stays], model.delta[stays]]
            columns += [model.y[others], model.d[others], model.W[others]]
        return np.concatenate([np.zeros(0, dtype=np.intp), *columns])
