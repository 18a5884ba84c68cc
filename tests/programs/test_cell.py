"""Cells are checked when they are made: each fault gets one sentence that names the place."""

from dataclasses import replace

import pytest

from robojoule.errors import InputError
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.programs.cell import Choice, Collision, Handover, Movement, PowerMode, TimeLag
from tests.planning.cells.cases import moving, standing, two_robots


def with_robot(cell, **changes):
    """The cell with its first robot changed."""
    return replace(cell, robots=(replace(cell.robots[0], **changes), *cell.robots[1:]))


def changed(cell, activity, /, **changes):
    """The cell with an activity of its first robot changed."""
    robot = cell.robots[0]
    return with_robot(
        cell,
        static=tuple(replace(one, **changes) if one.name == activity else one for one in robot.static),
        dynamic=tuple(replace(one, **changes) if one.name == activity else one for one in robot.dynamic),
    )


CONCAVE = PiecewiseLinearProfile([1.0, 2.0, 3.0], [10.0, 30.0, 40.0])
NEGATIVE = PiecewiseLinearProfile([1.0, 2.0, 3.0], [10.0, -30.0, 40.0])
FAULTS = {
    "cycle time": (lambda c: replace(c, cycle_time_s=0.0), "cycle time 0 s is out of range"),
    "no robot": (lambda c: replace(c, robots=(), lags=(), handovers=(), collisions=()), "no robot"),
    "robot twice": (lambda c: replace(c, robots=(c.robots[0], c.robots[0])), "robot 'A' appears twice"),
    "activity twice": (lambda c: changed(c, "a1", name="a2"), "activity 'a2' appears twice"),
    "no mode": (lambda c: with_robot(c, modes=()), "no power mode"),
    "idle time": (lambda c: with_robot(c, modes=(PowerMode("on", -1.0),)), "idle time -1 s"),
    "last": (lambda c: with_robot(c, last="a0>a1"), "last activity of the cycle"),
    "window": (lambda c: changed(c, "a1", least_s=30.0), "activity a1: the window from 30 s to 20 s"),
    "no location": (lambda c: changed(c, "a1", locations=()), "activity a1: there is no location"),
    "power": (lambda c: changed(c, "a2", locations=standing("x", 0, 1, p=(-1.0, 2.0)).locations), "power -1 W"),
    "no movement": (lambda c: changed(c, "a0>a1", movements=()), "activity a0>a1: there is no movement"),
    "wrong activities": (lambda c: changed(c, "a0>a1", end="b0"), "join 'b0'"),
    "wrong location": (
        lambda c: changed(c, "a0>a1", movements=(Movement("m", "p", "z", CONCAVE.lower_hull),)),
        "names location 'z'",
    ),
    "not convex": (lambda c: changed(c, "a0>a1", movements=(Movement("m", "p", "p", CONCAVE),)), "not convex"),
    "negative": (lambda c: changed(c, "a0>a1", movements=(Movement("m", "p", "p", NEGATIVE),)), "negative energy"),
    "no tour": (
        lambda c: with_robot(c, dynamic=(moving("a0>a1", "a0", "a1", ("p", "p", 1.0, 200.0)),)),
        "robot A: there is no closed tour",
    ),
    "lag": (lambda c: replace(c, lags=(TimeLag("a1", "nothing", 1.0),)), "names the activity 'nothing'"),
    "lag in a robot": (lambda c: replace(c, lags=(TimeLag("a1", "a2", 1.0),)), "two activities of one robot"),
    "lag length": (lambda c: replace(c, lags=(TimeLag("a1", "b1", float("nan")),)), "out of range"),
    "hand-over": (lambda c: replace(c, handovers=(Handover("a1", "b1", (("p", "z"),)),)), "no location 'z'"),
    "moving hand-over": (lambda c: replace(c, handovers=(Handover("a0>a1", "b1", (("pp", "p"),)),)), "static"),
    "moving hand-over without pairs": (lambda c: replace(c, handovers=(Handover("a1", "b0>b1", ()),)), "static"),
    "collision": (
        lambda c: replace(c, collisions=(Collision(Choice("a0>a1", "zz"), Choice("b1", "p")),)),
        "no movement 'zz'",
    ),
}


@pytest.mark.parametrize(("change", "problem"), FAULTS.values(), ids=FAULTS)
def test_faults_are_named(change, problem):
    with pytest.raises(InputError) as raised:
        change(two_robots())
    assert problem in str(raised.value)


def test_the_cell_knows_who_does_what():
    cell = two_robots()
    assert cell.robot_of["a0>a2"] == "A" and cell.robot_of["b1"] == "B"
    assert {one.name for one in cell.leaving("a0")} == {"a0>a1", "a0>a2"}
    assert repr(cell) == "Cell('two robots': robots=2, activities=13, cycle_time_s=9)"
