"""The check against plans that try to fool it: each violates one thing, and that is what is found."""

from dataclasses import replace

import pytest

from benchmarks.generated_cells import generate_cell
from robojoule.errors import PlanningError
from robojoule.planning.cells import exact
from robojoule.planning.cells.check import check_plan, checked
from robojoule.planning.cells.solve import solve_cell
from robojoule.profile.monomials import MonomialProfile
from robojoule.programs.cell import Choice, Collision, Handover, PowerMode, TimeLag
from tests.planning.cells.cases import two_robots

CELL = two_robots()


@pytest.fixture(scope="module")
def plan():
    return solve_cell(CELL)


def with_step(plan, activity, /, **changes):
    return replace(
        plan, steps=tuple(replace(one, **changes) if one.activity == activity else one for one in plan.steps)
    )


def step(plan, activity):
    return next(one for one in plan.steps if one.activity == activity)


def violations(plan, cell=CELL):
    return check_plan(cell, plan).violations


def test_a_good_plan_passes(plan):
    check = check_plan(CELL, plan)
    assert check.feasible
    assert check.energy_j == pytest.approx(plan.energy_j, rel=1e-12)
    assert checked(CELL, plan) is plan
    order = replace(plan, steps=plan.steps[::-1])  # the file's order does not matter
    assert check_plan(CELL, order).feasible
    later = replace(plan, steps=tuple(replace(one, start_s=one.start_s + 3.0) for one in plan.steps))
    assert check_plan(CELL, later).feasible


@pytest.mark.parametrize(("robots", "seed"), [(2, 3), (3, 3), (5, 3)])
def test_plans_that_cells_were_built_around_pass(robots, seed):
    cell, known = generate_cell(robots, seed)
    assert check_plan(cell, known).violations == ()


def test_a_shorter_movement_leaves_a_gap(plan):
    moving = step(plan, "a0>a1")
    energy = float(CELL.dynamic["a0>a1"].movements[0].profile.value(moving.duration_s - 0.1))
    found = violations(with_step(plan, "a0>a1", duration_s=moving.duration_s - 0.1, energy_j=energy))
    assert any("but a0>a1 before it ends" in one for one in found)
    assert any("of robot A take 8.900000 s, not 9.000000 s" in one for one in found)


def test_cheaper_energies_are_found(plan):
    assert any("J, not" in one for one in violations(with_step(plan, "a0>a1", energy_j=1.0)))


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"duration_s": float("nan")}, "must be finite"),
        ({"robot": "B"}, "robot B has no activity a0>a1"),
        ({"activity": "nothing"}, "robot A has no activity nothing"),
        ({"option": "zz"}, "no option zz"),
        ({"mode": "on"}, "no power mode on"),
        ({"duration_s": 0.1}, "takes 0.1 s, not 0.8 to 6 s"),
        ({"option": "pq"}, "needs location q of activity a1, not p"),
    ],
)
def test_a_wrong_step_is_found(plan, change, problem):
    assert any(problem in one for one in violations(with_step(plan, "a0>a1", **change)))


def test_what_is_left_out_or_done_twice_is_found(plan):
    without = replace(plan, steps=tuple(one for one in plan.steps if one.activity != "a2"))
    assert any("leaves out activity a2" in one for one in violations(without))
    twice = replace(plan, steps=(*plan.steps, step(plan, "a2")))
    assert any("a2 is done 2 times" in one for one in violations(twice))
    unjoined = replace(plan, steps=tuple(one for one in plan.steps if one.activity != "a2>a0"))
    assert any("no closed tour" in one for one in violations(unjoined))


def test_two_small_tours_are_not_one(plan):
    """a0-a1-a0 and a2 apart: every activity is done, movements join, yet it is not a tour."""
    keep = [one for one in plan.steps if one.robot == "B" or one.activity in ("a0", "a1", "a2", "a0>a1")]
    back = replace(step(plan, "a1>a2"), activity="a1>a0", option="pp")
    assert any("no closed tour" in one for one in violations(replace(plan, steps=(*keep, back))))


def test_idle_time_modes_and_windows_are_checked(plan):
    short = replace(
        CELL, robots=(replace(CELL.robots[0], modes=(PowerMode("on"), PowerMode("brakes", 1.5))), CELL.robots[1])
    )
    assert any("takes 1 s, not 1.5 to 20 s" in one for one in violations(plan, short))
    assert any("no power mode off" in one for one in violations(with_step(plan, "a1", mode="off")))


def test_lags_poses_and_collisions_are_checked(plan):
    late = replace(CELL, lags=(TimeLag("a1", "b1", 100.0, 1),))
    assert any("the time lag demands 91.000000 s" in one for one in violations(plan, late))
    chosen = step(plan, "a1").option, step(plan, "b1").option
    other = tuple(pair for pair in CELL.handovers[0].pairs if pair != chosen)
    apart = replace(CELL, handovers=(Handover("a1", "b1", other),))
    assert any("do not fit together" in one for one in violations(plan, apart))


def overlapping(plan, cycle_time_s=9.0):
    """Pairs of activities of both robots that overlap in a repeated cycle, by looking at many instants."""
    found = set()
    for a in (one for one in plan.steps if one.robot == "A"):
        for b in (one for one in plan.steps if one.robot == "B"):
            for instant in range(900):
                inside = [
                    1e-3 < (instant * cycle_time_s / 900 - one.start_s) % cycle_time_s < one.duration_s - 1e-3
                    for one in (a, b)
                ]
                if all(inside):
                    found.add((Choice(a.activity, a.option), Choice(b.activity, b.option)))
    return found


def test_collisions_are_what_overlaps_in_any_cycle(plan):
    together = overlapping(plan)
    assert 3 < len(together) < 24
    for a in (one for one in plan.steps if one.robot == "A"):
        for b in (one for one in plan.steps if one.robot == "B"):
            pair = Collision(Choice(a.activity, a.option), Choice(b.activity, b.option))
            collide = any("collide" in one for one in violations(plan, replace(CELL, collisions=(pair,))))
            assert collide == (pair in together), pair


def test_another_cycle_time_is_found(plan):
    assert any("the cycle time is 9 s" in one for one in violations(plan, replace(CELL, cycle_time_s=10.0)))


def test_a_cycle_time_that_is_no_number_and_a_bound_above_the_energy_are_found(plan):
    assert any("the cycle time is nan s" in one for one in violations(replace(plan, cycle_time_s=float("nan"))))
    assert any("less than the bound" in one for one in violations(replace(plan, bound_j=1.001 * plan.energy_j)))
    assert violations(replace(plan, bound_j=plan.energy_j)) == ()


def test_a_plan_that_fails_is_not_given_out(plan):
    with pytest.raises(PlanningError, match="does not pass the check"):
        checked(CELL, with_step(plan, "a0>a1", energy_j=0.0))


def test_energy_outside_the_window_is_not_extrapolated(plan):
    """A duration beyond the window may not look cheaper than the window's end."""
    movement = CELL.dynamic["a0>a1"].movements[0]
    assert isinstance(movement.profile, MonomialProfile)
    long = with_step(plan, "a0>a1", duration_s=50.0, energy_j=0.0)
    assert check_plan(CELL, long).energy_j > plan.energy_j


def test_a_plan_below_the_bound_of_its_own_search_is_not_given_out(monkeypatch):
    """A fault of the model, planted: its relaxation claims 1 % more than the optimum."""
    best = solve_cell(CELL).energy_j
    cut = exact.cut_relaxation
    monkeypatch.setattr(exact, "cut_relaxation", lambda *given: replace(cut(*given), bound_j=1.01 * best))
    with pytest.raises(PlanningError, match=r"does not pass the check: the plan takes .* less than the bound"):
        solve_cell(CELL)
