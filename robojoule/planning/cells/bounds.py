"""A bound of large cells from single robots that pay for what joins them: Lagrangian relaxation of lags and hand-overs.

Between robots there are rows A x >= b (time lags, hand-overs; the latter with their signs turned) and meetings, beside
which the model falls apart into robots r, with their costs c, what they may do X_r, and phases t within known bounds.
For all prices p >= 0 of these rows

    energy >= p b + sum_r min { (c - A' p) x : x in X_r } + sum_r min { -(A' p)_t t : low_t <= t <= high_t }

as each x that a plan gives keeps all rows, so p (b - A x) <= 0. Meetings are left out. The prices are the duals of the
relaxation without integers and meetings, where the right side equals its objective if each X_r is relaxed as well; with
the integers of the robots it is higher. Robots that have not been solved yet count with their relaxation, so the sum is
a bound at any time. Energies are tangents from below, so it is one of the true energy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index
from robojoule.planning.cells.exact import add_price_tangents, cut_relaxation
from robojoule.planning.cells.linear import INF, Limits
from robojoule.planning.cells.model import CellModel
from robojoule.planning.cells.numbering import Numbering

_SHARE = 5e-4  # of the objective that the tangents of the relaxation may miss: robots get their own ones later
_OFFSETS_W = (-3.0, 0.0, 3.0)  # from a robot's price of time, at which it gets tangents
_ROUNDS = 3
_LEAST_J = 1e-6  # of a bound that a share is taken of: robots may cost nothing


class PricedRobots:
    """The robots of a cell, each by itself, at prices of time lags and hand-overs.

    Args:
        numbers: The cell.

    Attributes:
        rows: Of the joint model: time lags, then hand-overs.
        bounds_j: Bound of each robot's cost at the prices, minus infinity before the first. [J]
    """

    def __init__(self, numbers: Numbering) -> None:
        self.numbers = numbers
        self.joint = CellModel(numbers, without=("meetings",))
        self.rows: Sequence[int] = [*self.joint.lag_rows, *self.joint.handover_rows]
        self.bounds_j: dict[int, float] = dict.fromkeys(range(numbers.robots), -INF)
        self._robots: dict[int, CellModel] = {}
        self._rest_j = 0.0

    @property
    def bound_j(self) -> float:
        """Bound of the energy of all plans; minus infinity before all robots are relaxed. [J]"""
        return self._rest_j + sum(self.bounds_j.values())

    def relax(self, limits: Limits) -> tuple[float, Array]:
        """Solve the joint relaxation.

        Returns:
            Its objective, a bound itself, minus infinity if there was no time for it [J]; a price for each of `rows`.
        """
        found = cut_relaxation(self.joint, limits, _SHARE)
        if found.duals is None:
            return found.bound_j, np.zeros(len(self.rows))
        return found.bound_j, found.duals[list(self.rows)]

    def price(self, prices: ArrayLike, limits: Limits) -> None:
        """Let robots pay, and relax them.

        Args:
            prices: Of each of `rows`, as duals are: 0 or more where a row has a lower bound, 0 or less where it has an
                upper one; others count as 0.
            limits: When to end.
        """
        program = self.joint.program
        cost, self._rest_j = program.priced(self.rows, prices)
        phases = self.joint.t
        low, high = np.array(program.lower)[phases], np.array(program.upper)[phases]
        self._rest_j += float(np.minimum(cost[phases] * low, cost[phases] * high).sum())
        for r in self.bounds_j:
            robot = CellModel(self.numbers, [r])
            for mine, joint in zip(_columns(robot), _columns(self.joint), strict=True):
                own = mine >= 0
                for column, value in zip(mine[own].tolist(), cost[joint[own]].tolist(), strict=True):
                    robot.program.cost[column] = value
            self._robots[r] = robot
            found = cut_relaxation(robot, limits)
            self.bounds_j[r] = found.bound_j
            add_price_tangents(robot, found.prices_w, _OFFSETS_W)

    def solve(self, r: int, limits: Limits, tolerance_j: float) -> None:
        """Sharpen the bound of a robot by its integers.

        Args:
            r: The robot.
            limits: When to end.
            tolerance_j: By how much the bound may be below the optimum. [J]
        """
        robot, n = self._robots[r], self.numbers
        t = robot.movements
        for _ in range(_ROUNDS):
            gap = min(tolerance_j / max(abs(self.bounds_j[r]), _LEAST_J), 1.0)
            found = robot.program.solve(replace(limits, gap=gap))
            if -INF < found.bound < INF:
                self.bounds_j[r] = max(self.bounds_j[r], found.bound)
            if found.values is None or found.status != "optimal":
                break
            done = t[found.values[robot.y[t]] > 0.5]
            at = np.clip(found.values[robot.d[done]], n.d_min_s[done], n.d_max_s[done])
            if float((n.energies_j(done, at) - found.values[robot.W[done]]).sum()) <= tolerance_j:
                break
            robot.add_tangents(done, at)


def _columns(model: CellModel) -> tuple[Index, ...]:
    """Columns of what each robot has for itself; -1 where a model does not hold it."""
    return model.u, model.delta, model.y, model.d, model.W, model.f
