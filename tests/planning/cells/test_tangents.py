"""Where tangents are put: they share the error, also where a movement may take no time."""

from dataclasses import replace

import numpy as np
import pytest

from robojoule.planning.cells.numbering import Numbering
from robojoule.planning.cells.solve import solve_cell
from robojoule.planning.cells.tangents import spread_durations_s
from robojoule.profile.monomials import MonomialProfile
from robojoule.profile.piecewise import PiecewiseLinearProfile
from tests.planning.cells.cases import two_robots


def with_profile(profile):
    """The cell of two robots with another energy of its first movement."""
    cell = two_robots()
    robot, *others = cell.robots
    activity, *rest = robot.dynamic
    movement, *more = activity.movements
    activity = replace(activity, movements=(replace(movement, profile=profile), *more))
    return replace(cell, robots=(replace(robot, dynamic=(activity, *rest)), *others))


@pytest.mark.parametrize(("shortest", "longest"), [(0.5, 4.0), (1e-6, 4.0), (0.0, 4.0), (2.0, 2.0)])
def test_tangents_lie_within_the_window_and_apart(shortest, longest):
    durations = np.unique([shortest, longest])
    cell = with_profile(PiecewiseLinearProfile(durations, np.full(durations.size, 100.0)))
    with np.errstate(all="raise"):
        at = np.concatenate(spread_durations_s(Numbering(cell), np.array([0]), 5))
    assert (at >= shortest).all() and (at <= longest).all()
    assert np.unique(at).size == (5 if longest > shortest else 1)


def test_tangents_of_a_hyperbola_miss_alike_between_each_other():
    """Oracle: those of E = 1 / d at a and b meet at d = 2 a b / (a + b)."""
    numbers = Numbering(with_profile(MonomialProfile(0.5, 4.0, ((-1.0, 1.0),))))
    at = np.sort(np.concatenate(spread_durations_s(numbers, np.array([0]), 40)))
    a, b = at[:-1], at[1:]
    meet = 2.0 * a * b / (a + b)
    missed = 1.0 / meet - (2.0 / a - meet / a**2)
    assert missed.max() < 1.2 * missed.min()


def test_a_movement_that_may_take_no_time_is_planned():
    """By hand: it costs 100 J at once and 20 J from 0.8 s on, so it takes its time."""
    cell = with_profile(PiecewiseLinearProfile(np.array([0.0, 0.8, 4.0]), np.array([100.0, 20.0, 20.0])))
    with np.errstate(all="raise"):
        plan = solve_cell(replace(cell, lags=(), handovers=(), collisions=()))
    moved = [step for step in plan.steps if (step.activity, step.option) == ("a0>a1", "pp")]
    assert plan.status == "optimal" and len(moved) == 1 and moved[0].duration_s >= 0.8 - 1e-6
