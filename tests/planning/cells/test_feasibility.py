"""Cells without a plan: the error says which robot or which lags, and the least cycle time."""

from dataclasses import replace

import pytest

from robojoule.errors import CycleTimeTooShort, InputError, PlanningError
from robojoule.planning.cells.feasibility import NO_PLAN, UNEXPLAINED, explain
from robojoule.planning.cells.linear import Limits
from robojoule.planning.cells.numbering import Numbering
from robojoule.planning.cells.solve import solve_cell
from robojoule.programs.cell import Choice, Collision, Handover, TimeLag
from tests.planning.cells.cases import free_of_charge, two_robots


def refusal(cell):
    with pytest.raises(InputError) as raised:
        solve_cell(cell)
    return raised.value


def test_the_slowest_robot_is_named():
    """A needs 0.5 + 0.6 + 0.4 s of standing and 0.8 + 0.9 + 0.7 s, or 0.6 + 0.9 + 0.9 s, of moving: 3.9 s."""
    error = refusal(two_robots(3.5))
    assert isinstance(error, CycleTimeTooShort)
    assert error.minimum_s == pytest.approx(3.9, abs=1e-6)
    assert "forced by robot A" in str(error)


def test_the_least_cycle_time_has_a_plan():
    assert solve_cell(two_robots(3.9 + 1e-4)).cycle_time_s < 3.91


def test_the_lags_are_named():
    """b1 may start 1 s after a1's start one cycle before, and a1 8 s after b1 ends: at least 1 + 8 + 1 s around."""
    cell = replace(two_robots(9.0), lags=(TimeLag("a1", "b1", 1.0, 1), TimeLag("b1>b0", "a1", 8.0, 0)))
    error = refusal(cell)
    assert isinstance(error, CycleTimeTooShort)
    assert error.minimum_s == pytest.approx(10.0, abs=1e-6)
    assert "a1 and b1" in str(error) and "b1>b0 and a1" in str(error)
    assert solve_cell(replace(cell, cycle_time_s=10.001)).status == "optimal"


def test_lags_that_contradict_each_other_are_told():
    """Of four lags two go round in no time; only these are named."""
    others = (TimeLag("a2", "b0", 0.5, 1), TimeLag("b0", "a2", 0.5, 1))
    cell = replace(two_robots(), lags=(others[0], TimeLag("a1", "b1", 1.0, 0), others[1], TimeLag("b1", "a1", 1.0, 0)))
    error = str(refusal(cell))
    assert "between activities a1 and b1, b1 and a1 contradict each other" in error


def test_a_cycle_time_that_is_enough_for_collisions_is_named():
    """While one robot is away from a0 or b0 the other is not: both take turns."""
    cell = two_robots(5.0)
    options = [
        [Choice(one.name, place.name) for one in robot.static if one.name != robot.last for place in one.locations]
        + [Choice(one.name, movement.name) for one in robot.dynamic for movement in one.movements]
        for robot in cell.robots
    ]
    pairs = tuple(Collision(a, b) for a in options[0] for b in options[1])
    tight = replace(cell, collisions=pairs, lags=(), handovers=())
    error = refusal(tight)
    assert isinstance(error, CycleTimeTooShort)
    assert "exclude each other" in str(error) and 5.0 < error.minimum_s < 7.6
    assert solve_cell(replace(tight, cycle_time_s=error.minimum_s + 1e-6), gap_percent=50.0).energy_j > 0.0


def test_robots_that_never_take_equally_long_are_told():
    cell = two_robots()
    short = tuple(replace(one, longest_s=max(one.least_s, 1.0)) for one in cell.robots[1].static)
    robots = (cell.robots[0], replace(cell.robots[1], static=short))
    slow = tuple(replace(one, least_s=20.0) if one.name == "a0" else one for one in cell.robots[0].static)
    robots = (replace(cell.robots[0], static=slow), robots[1])
    assert "no common cycle time" in str(refusal(replace(cell, robots=robots, handovers=(), collisions=())))


def test_a_cycle_that_a_robot_cannot_fill_is_told():
    """B stands at b0 for 20 s and at b1 for 2.5 s at most, and moves for 6 s twice: 34.5 s."""
    error = refusal(two_robots(40.0))
    assert "the cycle time 40 s is longer than the slowest cycle of robot B; allowed: at most 34.5" in str(error)
    assert solve_cell(two_robots(34.4)).status == "optimal"


def test_lags_that_a_cycle_is_too_long_for_are_told():
    """a1 starts 5 s at the most after b1 of the cycle before, and b1 1 s at the most after a1: at most 6 s around."""
    cell = replace(two_robots(9.0), lags=(TimeLag("a1", "b1", -5.0, -1), TimeLag("b1", "a1", -1.0, 0)), collisions=())
    error = str(refusal(cell))
    assert (
        "the cycle time 9 s is longer than the slowest cycle, which is forced by time lags between activities" in error
    )
    assert "a1 and b1, b1 and a1; allowed: at most 6.000000 s" in error
    assert solve_cell(replace(cell, cycle_time_s=5.999)).status == "optimal"
    assert "longer than the slowest cycle" in str(refusal(replace(cell, cycle_time_s=6.001)))


def test_hand_overs_that_need_a_longer_cycle_are_named():
    """Of two hand-overs one leaves only q for a1: 0.6 + 1.2 + 0.8 s of moving (a0, a2, a1) and 1.5 s of standing."""
    pairs = tuple((a, b) for a in "pq" for b in "pq")
    cell = replace(two_robots(4.0), lags=(), collisions=())
    assert solve_cell(replace(cell, handovers=())).status == "optimal"
    slower = replace(cell, handovers=(Handover("a1", "b0", (("p", "p"), ("q", "p"))), Handover("a1", "b1", pairs[2:])))
    error = refusal(slower)
    assert isinstance(error, CycleTimeTooShort)
    assert "forced by hand-over locations of activities a1 and b1; allowed" in str(error)
    assert error.minimum_s == pytest.approx(4.1, abs=1e-6)


def test_hand_overs_without_a_pair_are_told():
    cell = replace(two_robots(), handovers=(Handover("a1", "b1", ()),))
    assert "hand-overs between activities a1 and b1 cannot" in str(refusal(cell))


def test_a_search_without_time_says_that_it_found_nothing():
    from tests.planning.cells.cases import generated

    with pytest.raises(PlanningError, match="no plan of cell 'generated_4_0' was found"):
        solve_cell(generated(4, 0, (10, 12)), time_limit_s=0.01, stop=lambda: True)


@pytest.mark.parametrize(
    ("given", "problem"),
    [
        ({"time_limit_s": 0.0}, "time_limit"),
        ({"gap_percent": -1.0}, "gap"),
        ({"threads": 0}, "threads"),
        ({"threads": 1.5}, "threads: 1.5 is not a whole number; allowed: 1 to 1024 threads"),
        ({"seed": 0.5}, "seed: 0.5 is not a whole number"),
        ({"executor": 3}, "executor: 3 is not an executor"),
    ],
)
def test_settings_out_of_range_are_refused(given, problem):
    with pytest.raises(InputError, match=problem):
        solve_cell(two_robots(), **given)


def test_progress_is_told_and_never_worse():
    seen = []
    plan = solve_cell(two_robots(), progress=seen.append)
    energies, bounds = [one.energy_j for one in seen], [one.bound_j for one in seen]
    assert energies == sorted(energies, reverse=True) and bounds == sorted(bounds)
    assert energies[-1] == pytest.approx(plan.energy_j) and seen[-1].gap_percent <= 0.01
    assert seen[0].text.endswith(": no plan yet")
    assert seen[-1].text.endswith(f"{plan.energy_j:.1f} J, bound {plan.bound_j:.1f} J, gap 0.000 %")
    assert seen[0].total == 60.0 and all(one.left_s(0.0) == 60.0 - one.done for one in seen)


def test_a_cell_in_which_nothing_costs_energy_is_planned_before_a_listener():
    """By hand: 0 J, and no gap to nothing."""
    seen = []
    plan = solve_cell(free_of_charge(), progress=seen.append)
    assert (plan.status, plan.energy_j, plan.bound_j) == ("optimal", 0.0, 0.0)
    assert seen[-1].gap_percent == 0.0 and seen[-1].text.endswith("0.0 J, bound 0.0 J, gap 0.000 %")


CONTRADICTING = replace(two_robots(), lags=(TimeLag("a1", "b1", 1.0, 0), TimeLag("b1", "a1", 1.0, 0)))
UNFIT = replace(two_robots(), handovers=(Handover("a1", "b1", ()),))


@pytest.mark.parametrize(
    "cell", [two_robots(3.5), two_robots(40.0), CONTRADICTING, UNFIT], ids=["short", "long", "lags", "poses"]
)
@pytest.mark.parametrize("over", [Limits(until=0.0), Limits(stop=lambda: True)], ids=["late", "stopped"])
def test_the_reason_is_not_sought_when_the_time_is_up_or_a_stop_is_asked_for(cell, over):
    assert type(explain(Numbering(cell), over)) is InputError
    assert str(explain(Numbering(cell), over)) == UNEXPLAINED


def test_the_reason_is_left_out_on_request():
    with pytest.raises(InputError) as raised:
        solve_cell(two_robots(3.5), explained=False)
    assert str(raised.value) == NO_PLAN


def test_long_names_leave_a_message_whole():
    """Names that a message has no room for are counted, not cut."""
    long = {name: f"{name} {'of a station with a long name ' * 2}".strip() for name in ("a1", "b1", "a2", "b0")}

    def renamed(name):
        return long.get(name, name)

    cell = two_robots()
    robots = tuple(
        replace(
            robot,
            static=tuple(replace(one, name=renamed(one.name)) for one in robot.static),
            dynamic=tuple(replace(one, start=renamed(one.start), end=renamed(one.end)) for one in robot.dynamic),
            last=renamed(robot.last),
        )
        for robot in cell.robots
    )
    lags = (TimeLag(long["a1"], long["b1"], 1.0, 0), TimeLag(long["b1"], long["a1"], 1.0, 0))
    error = str(refusal(replace(cell, robots=robots, lags=lags, handovers=(), collisions=())))
    assert f"{long['a1']} and {long['b1']} and 1 more contradict each other at any cycle time" in error
    assert "..." not in error
