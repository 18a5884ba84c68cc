"""Plans of cells of robots, end to end: what is promised holds in the simulation of all robots together."""

from dataclasses import replace

import numpy as np
import pytest

import robojoule as rj
from robojoule.errors import CycleTimeTooShort, InputError, PlanningError
from robojoule.formats.robot_cell import Place
from robojoule.planning.cells.solve import SearchProgress
from robojoule.planning.robot_cells.cell_model import CellWork
from robojoule.planning.robot_cells.fidelity import pose_of
from robojoule.planning.robot_cells.solve import NOT_WHOLE, Search, plan_robot_cell
from robojoule.planning.robot_cells.timeline import Timeline
from robojoule.progress import Progress
from robojoule.robots.controller_file import ControllerTiming
from tests.planning.robot_cells.cases import LONG_S, plan_of_three, planned, six, three, work_of_three


def test_the_plan_of_three_robots_holds():
    cell, plan = three(), plan_of_three()
    assert plan.status == "optimal" and plan.gap_percent <= 0.1
    assert plan.run.violations == ()
    assert plan.bound_j <= plan.energy_j < plan.energy_given_j
    assert plan.run.clearance_m >= cell.safety_distance_m
    assert len(plan.run.meetings) == 3
    assert len(plan.run.handovers) == 3 and all(one.spare_s >= -1e-6 for one in plan.run.handovers)
    for program, run in zip(plan.programs, plan.run.runs, strict=True):
        assert run.cycle_time_s == pytest.approx(cell.cycle_time_s, abs=1e-6)
        assert all(move.speed_limit_percent == round(move.speed_limit_percent) for move in program.moves)


def test_a_plan_below_its_bound_is_not_given_out(monkeypatch):
    """A fault of the profiles, planted: process steps count 5 % of the plan's energy too much."""
    more_j = 0.05 * plan_of_three().energy_j
    wrong = work_of_three().process_j + more_j
    monkeypatch.setattr(CellWork, "process_j", property(lambda _: wrong))
    with pytest.raises(PlanningError, match=r"takes .* J, less than its bound of"):
        planned(three(), exclusive=True)


def test_the_robots_agree_on_a_pose():
    cell, plan = three(), plan_of_three()
    moves = ("to table", "to part", "to table")
    chosen = {pose_of(one, program, move) for one, program, move in zip(cell.robots, plan.programs, moves, strict=True)}
    assert len(chosen) == 1 and chosen <= {"place 1", "place 2"}


def test_each_program_says_for_which_cycle_time_it_was_planned():
    assert {program.tree.planned_cycle_s for program in plan_of_three().programs} == {round(three().cycle_time_s, 6)}


def test_each_program_by_itself_takes_what_the_plan_says():
    """Oracle: the simulation of single programs, which knows nothing of cells."""
    cell, plan = three(), plan_of_three()
    alone = [rj.simulate(program, one.robot) for one, program in zip(cell.robots, plan.programs, strict=True)]
    assert sum(run.energy_j for run in alone) == pytest.approx(plan.energy_j, rel=1e-9)


@pytest.mark.parametrize("number", [0, 2])
def test_a_cell_of_one_robot_is_the_plan_of_that_robot(number):
    """Oracle: the plan of a single robot, which has no model in common with that of cells."""
    one = replace(three().robots[number], alternatives={})
    alone = replace(three(), robots=(one,), handovers=(), zones=())
    plan = plan_robot_cell(alone, time_limit_s=LONG_S)
    single = rj.optimize(one.program, one.robot, cycle_time=three().cycle_time_s)
    assert plan.energy_j == pytest.approx(single.energy_j, rel=1e-3)
    assert plan.bound_j <= single.energy_j
    assert plan.run.meetings == () and plan.to_dict()["clearance_m"] is None


@pytest.mark.parametrize("dead_time_s", [0.02, -0.01])
def test_robots_with_learnt_controllers(dead_time_s):
    """Their motions take a little more or less than their time laws, and stand still after them."""
    robots = []
    for one in three().robots:
        timing = ControllerTiming(
            rule="joint_accelerations",
            velocity_rad_s=0.9 * one.robot.velocity_rad_s,
            acceleration_rad_s2=2.0 * one.robot.velocity_rad_s,
            acceleration_factor=1.0,
            acceleration_exponent=0.5,
            filter_time_s=0.05,
            dead_time_s=dead_time_s,
            least_cruise_share=0.0,
            duration_error=0.0,
        )
        robots.append(replace(one, robot=one.robot.variant(controller=timing)))
    cell = replace(three(), robots=tuple(robots), cycle_time_s=9.0)
    plan = plan_robot_cell(cell, time_limit_s=LONG_S, gap_percent=1.0)
    assert plan.run.violations == () and plan.run.clearance_m >= cell.safety_distance_m


def test_steps_add_up_to_the_energy():
    plan = plan_of_three()
    assert sum(step.energy_j for step in plan.steps) == pytest.approx(plan.energy_j, rel=1e-12)
    weld = next(step for step in plan.steps if step.activity == "welder: to part (standing)")
    assert weld.energy_j >= 1.2 * 1500.0  # the process step is part of it


def test_without_the_shared_space_robots_collide():
    found = planned(three(), exclusive=False)
    assert found.run.clearance_m < 0.0
    assert any("come within" in one for one in found.run.violations)
    assert found.energy_j < plan_of_three().energy_j  # so the space binds


def test_six_robots_with_and_without_the_shared_space():
    kept = planned(six(), exclusive=True)
    assert kept.run.violations == ()
    assert kept.run.clearance_m >= six().safety_distance_m
    assert len(kept.run.handovers) == 7 and all(one.spare_s >= -1e-6 for one in kept.run.handovers)
    free = planned(six(), exclusive=False)
    assert free.run.clearance_m < 0.0 and free.energy_j < kept.energy_j


def test_a_largest_power_is_kept():
    free = plan_of_three()
    limit_w = 0.93 * free.run.peak_power_sum_w
    plan = plan_robot_cell(replace(three(), peak_power_w=limit_w), time_limit_s=LONG_S, gap_percent=1.0)
    assert plan.run.peak_power_sum_w <= limit_w < free.run.peak_power_sum_w
    assert plan.peak_power_w <= plan.run.peak_power_sum_w
    assert plan.energy_j >= free.bound_j
    with pytest.raises(InputError, match="peak_power_w"):
        plan_robot_cell(replace(three(), peak_power_w=150.0))
    # Welding draws 1500 W, and the three robots stand at 48, 60 and 60 W at least.
    with pytest.raises(InputError, match=r"robot welder.*after move 'to part'.*peak_power_w of at least 1668 W"):
        plan_robot_cell(replace(three(), peak_power_w=1667.0))


def test_a_cycle_that_is_too_short_is_refused_with_the_least_one():
    with pytest.raises(CycleTimeTooShort, match="forced by") as caught:
        plan_robot_cell(replace(three(), cycle_time_s=2.0))
    assert caught.value.minimum_s > 2.0


def test_predicted_profiles_give_a_plan_that_is_simulated():
    plan = rj.optimize(three(), profiles="predicted", gap_percent=1.0, time_limit_s=LONG_S)
    assert plan.profiles == "predicted" and plan.run.violations == ()
    assert plan.energy_j >= plan_of_three().bound_j
    with pytest.raises(InputError, match="profiles"):
        rj.optimize(three(), profiles="guessed")


def test_equal_seeds_give_equal_plans():
    again = plan_robot_cell(three(), time_limit_s=LONG_S)
    assert [one.tree for one in again.programs] == [one.tree for one in plan_of_three().programs]
    assert again.run.starts_s == plan_of_three().run.starts_s


def test_a_stopped_search_gives_its_best_plan():
    """The stop comes with the first plan of the search."""
    seen: list[Progress] = []
    plan = plan_robot_cell(
        three(),
        gap_percent=0.0,
        time_limit_s=LONG_S,
        progress=seen.append,
        stop=lambda: any(isinstance(one, SearchProgress) and np.isfinite(one.energy_j) for one in seen),
    )
    assert plan.status == "feasible" and plan.run.violations == ()
    assert [one.work for one in seen if one.done == 0.0 and one.work.startswith("shared")] == [
        "shared space of two robots"
    ]


def test_a_plan_on_exact_speed_limits_holds_where_none_in_whole_percents_is_found(monkeypatch):
    def nothing(*_, **__):
        raise PlanningError("no time")

    monkeypatch.setattr(Search, "_whole", nothing)
    plan = plan_robot_cell(three(), time_limit_s=LONG_S, gap_percent=1.0)
    assert NOT_WHOLE in plan.warnings and plan.run.violations == ()
    limits = [move.speed_limit_percent for program in plan.programs for move in program.moves]
    assert any(limit != round(limit) for limit in limits)
    assert plan.energy_j == pytest.approx(plan_of_three().energy_j, rel=0.01)


def test_power_over_time_integrates_to_the_energy():
    """Oracle: quadrature of the summed power over the cycle."""
    cell, plan = three(), plan_of_three()
    lines = [
        Timeline(one, program, start, cell.cycle_time_s)
        for one, program, start in zip(cell.robots, plan.programs, plan.run.starts_s, strict=True)
    ]
    time = (np.arange(70_000) + 0.5) * cell.cycle_time_s / 70_000
    power = sum(line.power_w(time) for line in lines)
    assert power.mean() * cell.cycle_time_s == pytest.approx(plan.energy_j, rel=2e-4)
    assert plan.peak_power_w == pytest.approx(power.max(), rel=2e-3)
    assert power.max() <= plan.run.peak_power_sum_w * (1.0 + 1e-6)


def test_zones_and_geometry_name_choices_of_different_robots():
    work = work_of_three()
    model = work.cell_of(work.convex)
    for first, second in work.pairs:
        assert model.robot_of[first.activity] != model.robot_of[second.activity]
    zone = work.cell.zones[0]
    assert Place("welder", "weld") in zone.members
