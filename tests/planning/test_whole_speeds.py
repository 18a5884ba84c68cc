"""Plans in whole speed limits: against brute force over all of them, and what the program forbids."""

import itertools

import numpy as np
import pytest

import robojoule as rj
from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.formats.program import WAIT_STEP_S, Program
from robojoule.planning.batch import TreeBatch
from robojoule.planning.whole_speeds import speed_choices
from tests.core_cases import kr16
from tests.planning.trees import POINTS_DEG, busy_tree, tree


def moves_of(count):
    return Program(tree(points=(POINTS_DEG * 2)[: count // 2]))


def brute_force_j(batch, limits, cycle_time_s):
    """Least energy over all combinations of speed limits, waiting where that is cheapest."""
    table = [batch.paths.simulate(np.tile(row, (batch.paths.motions, 1))) for row in limits]
    idle_w = min(batch.idle_prior_w.min(), batch.idle_post_w.min())
    best = np.inf
    for options in itertools.product(*[range(len(row)) for row in limits]):
        duration = sum(table[i].duration_s[i, k] for i, k in enumerate(options))
        if duration <= cycle_time_s + 1e-9:
            energy = sum(table[i].energy_j[i, k] for i, k in enumerate(options))
            best = min(best, energy + idle_w * (cycle_time_s - duration))
    return best


@pytest.mark.parametrize("step, share", [(1.0, 1.1), (1.0, 1.6), (5.0, 1.05), (5.0, 1.3), (12.5, 1.2), (25.0, 3.0)])
def test_no_other_speed_limits_take_less(step, share):
    program = moves_of(2)
    batch = TreeBatch(kr16(), [program.tree])
    cycle = share * float(batch.least_cycles_s[0])
    plan = rj.optimize(program, kr16(), cycle_time=cycle, speed_step=step)
    best = brute_force_j(batch, speed_choices(batch, step), plan.cycle_time_s)
    assert plan.energy_j == pytest.approx(best, rel=3e-6)
    assert plan.bound_j <= best * (1.0 + 1e-9)
    assert plan.gap_to_optimum_percent <= 1e-3
    assert all(move.speed_limit_percent % step == 0.0 or move.speed_limit_percent == 100.0 for move in plan.moves)


def test_four_moves_are_not_rounded_one_by_one():
    """Rounding each speed limit up keeps the cycle time, too, but wastes energy."""
    program, step = moves_of(4), 10.0
    batch = TreeBatch(kr16(), [program.tree])
    cycle = 1.25 * float(batch.least_cycles_s[0])
    plan = rj.optimize(program, kr16(), cycle_time=cycle, speed_step=step)
    assert plan.energy_j == pytest.approx(brute_force_j(batch, speed_choices(batch, step), plan.cycle_time_s), rel=3e-6)
    fine = rj.optimize(program, kr16(), cycle_time=cycle, speed_step=0.01)
    rounded_up = {m.name: min(step * np.ceil(m.speed_limit_percent / step), 100.0) for m in fine.moves}
    run = rj.simulate(Program(program.tree.with_plan(rounded_up)), kr16())
    idle_w = min(batch.idle_prior_w.min(), batch.idle_post_w.min())
    assert run.cycle_time_s < cycle
    assert fine.energy_j <= plan.energy_j < run.energy_j + idle_w * (cycle - run.cycle_time_s) - 1.0


def given(**moves):
    """The busy program with settings of its moves."""
    return Program(busy_tree().with_settings(moves))


def test_given_speed_limits_are_upper_bounds():
    program = given(m0={"speed_limit_percent": 35.5}, m2={"speed_limit_percent": 20.0})
    plan = rj.optimize(program, kr16(), cycle_time="+5%")
    for before, after in zip(program.moves, plan.moves, strict=True):
        assert after.speed_limit_percent <= before.speed_limit_percent
        assert after.speed_limit_percent == before.speed_limit_percent or after.speed_limit_percent % 1.0 == 0.0
    faster = rj.optimize(program, kr16(), cycle_time=plan.cycle_time_s, allow_faster=True)
    assert faster.energy_j < plan.energy_j * 0.99
    assert faster.moves[-1].speed_limit_percent > 20.0
    assert faster.energy_given_j == pytest.approx(
        plan.energy_given_j, rel=1e-4
    )  # their cycles differ by a part of 1 ms


def test_fixed_moves_and_least_speeds_are_kept():
    settings = {
        "m0": {"speed_limit_percent": 83.3, "fixed": True},
        "m1": {"least_speed_percent": 66.6},
        "m2": {"speed_limit_percent": 0.7},  # slower than plans go: as it is
    }
    for faster in (False, True):
        plan = rj.optimize(given(**settings), kr16(), cycle_time=120.0, allow_faster=faster)
        speeds = {move.name: move.speed_limit_percent for move in plan.moves}
        assert speeds["m0"] == 83.3
        assert speeds["m1"] >= 67.0
        assert speeds["m2"] == 0.7 if not faster else speeds["m2"] >= 1.0


def test_a_cycle_time_that_only_faster_moves_reach_is_refused_with_both_figures():
    program = given(m0={"speed_limit_percent": 15.0})
    with pytest.raises(CycleTimeTooShort, match="within the program's speed limits") as caught:
        rj.optimize(program, kr16(), cycle_time=3.9)
    assert caught.value.faster_s < 3.9 < caught.value.minimum_s
    plan = rj.optimize(program, kr16(), cycle_time=3.9, allow_faster=True)
    assert 3.9 - WAIT_STEP_S < plan.cycle_time_s <= 3.9


def test_a_least_speed_above_the_speed_limit_is_refused():
    with pytest.raises(InputError, match="least_speed_percent is 50, more than the speed limit of 40 %"):
        given(m0={"speed_limit_percent": 40.0, "least_speed_percent": 50.0})


@pytest.mark.parametrize("step", [0.0, -1.0, 51.0, float("nan"), "1", True])
def test_a_step_that_no_controller_has_is_refused(step):
    with pytest.raises(InputError, match="speed_step"):
        rj.optimize(moves_of(2), kr16(), cycle_time="+5%", speed_step=step)


@pytest.mark.parametrize("share", [1.0, 1.08, 1.5, 4.0])
@pytest.mark.parametrize("step", [1.0, 7.0])
def test_a_plan_planned_again_stays_as_it_is(share, step):
    program = given(m0={"speed_limit_percent": 90.0}, m1={"wait_after_s": 0.2})
    cycle = share * rj.simulate(program, kr16()).cycle_time_s
    plan = rj.optimize(program, kr16(), cycle_time=cycle, speed_step=step)
    for again_in in (plan.cycle_time_s, cycle, "+0%"):
        again = rj.optimize(plan.program, kr16(), cycle_time=again_in, speed_step=step)
        assert again.program.tree == plan.program.tree
        assert again.saving_percent == pytest.approx(0.0, abs=1e-9)
        assert again.energy_unoptimized_j == pytest.approx(plan.energy_unoptimized_j, rel=1e-6)


def test_waits_that_a_plan_added_are_no_waits_of_the_process():
    program = given(m1={"wait_after_s": 0.2})
    plan = rj.optimize(program, kr16(), cycle_time=20.0, slowest_speed_limit_percent=10.0)
    added = sum(move.added_wait_before_s + move.added_wait_after_s for move in plan.program.moves)
    assert added > 5.0
    assert [move.wait_after_s for move in plan.program.moves] == [move.wait_after_s for move in program.moves]
    faster = rj.optimize(plan.program, kr16(), cycle_time=15.0)
    assert faster.cycle_time_s == pytest.approx(15.0, abs=WAIT_STEP_S)
    longer = rj.optimize(plan.program, kr16(), cycle_time="+10%")
    assert longer.cycle_time_s == pytest.approx(22.0, abs=2 * WAIT_STEP_S)
