"""Plans on profiles of any source: few simulated runs where plans are, or what a source says once and for all."""

import numpy as np
import pytest

from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import simulate_trees
from robojoule.planning.graph import process_energy_j
from robojoule.planning.pareto import pareto_curve
from robojoule.planning.source_plans import RELATIVE_GAP, plan_on_source
from robojoule.planning.writeback import write_plans
from robojoule.profile.adaptive import AdaptiveProfiles
from robojoule.profile.enclosure import Enclosure
from robojoule.profile.sampled import sampled_profile
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload
from tests.planning.trees import busy_tree, dense_plans, tree


@pytest.fixture(scope="module")
def batch():
    robot = load_robot("kuka_kr16_r2010_2", Payload(10.0, (0.0, 0.0, 0.1)))
    return TreeBatch(robot, [tree(), busy_tree()])


def profiles(batch):
    return AdaptiveProfiles(batch.paths, batch.slowest_speed_limit)


def test_plans_from_few_runs_are_near_the_optimum(batch):
    times = batch.least_cycles_s[:, None] * np.array([1.0, 1.1, 1.5, 2.0])
    source = profiles(batch)
    found = plan_on_source(source, batch, times).plans
    best = dense_plans(batch, times, 181)
    for runs, plans, optimum in zip(simulate_trees(batch, write_plans(batch, found)), found, best, strict=True):
        for run, plan, least in zip(runs, plans, optimum, strict=True):
            assert run.cycle_time_s == pytest.approx(plan.cycle_time_s, abs=1e-6)
            assert run.energy_j <= plan.energy_j * (1.0 + 1e-6)  # the model promises no less than what happens
            assert run.energy_j / least.energy_j - 1.0 < RELATIVE_GAP
            assert plan.bound_j <= least.energy_j * (1.0 + 1e-6)
            assert 1.0 - plan.bound_j / plan.energy_j <= RELATIVE_GAP
    assert source.runs.max() <= 30


def test_runs_are_added_only_where_a_plan_is(batch):
    one, many = profiles(batch), profiles(batch)
    plan_on_source(one, batch, batch.least_cycles_s[:, None] * 1.2)
    plan_on_source(many, batch, batch.least_cycles_s[:, None] * np.array([1.05, 1.2, 1.5, 2.0]))
    assert one.runs.sum() < many.runs.sum()


class FiveRuns:
    """A source that knows five runs of each motion and no more."""

    def __init__(self, batch):
        self.idle_start_w, self.idle_end_w = batch.idle_prior_w, batch.idle_post_w
        limits = batch.speed_limits(5)
        runs = batch.paths.simulate(limits)
        self.profiles = [
            sampled_profile(d, e, p).piecewise().lower_hull
            for d, e, p in zip(runs.duration_s, runs.energy_j, limits, strict=True)
        ]

    def enclosure(self, motion):
        return Enclosure.exact(self.profiles[motion])

    def refine_near(self, durations_s):
        assert durations_s == {}  # nothing is asked of a source whose profiles are exact
        return []


def test_exact_profiles_are_planned_to_what_they_say(batch):
    source = FiveRuns(batch)
    times = batch.least_cycles_s[:, None] * np.array([1.0, 1.2, 2.0])
    found = plan_on_source(source, batch, times)
    for number, (plans, costs) in enumerate(zip(found.plans, found.costs, strict=True)):
        assert [cost.profile for cost in costs] == source.profiles[batch.rows[number]]
        step = process_energy_j(batch.trees[number])
        expected = pareto_curve(batch.graphs[number], costs, fixed_energy_j=step).energy_j(times[number])
        assert [plan.energy_j for plan in plans] == pytest.approx(expected, rel=1e-12)
        assert [plan.bound_j for plan in plans] == pytest.approx(expected, rel=1e-12)
