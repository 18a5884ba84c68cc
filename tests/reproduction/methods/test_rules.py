"""Methods that need no solver: full speed, one speed limit for all, the steepest motions first."""

import numpy as np
import pytest

from reproduction.methods.greedy import Greedy, greedy_plan
from reproduction.methods.uniform import Uniform, uniform_speed_limits
from reproduction.methods.unoptimized import Unoptimized
from robojoule.errors import CycleTimeTooShort
from robojoule.planning.batch import TreeBatch
from robojoule.planning.rule import rule_plan
from robojoule.profile.sampled import sampled_profile, sampled_profiles
from tests.core_cases import kr16
from tests.planning.trees import busy_tree, tree


@pytest.fixture(scope="module")
def batch():
    return TreeBatch(kr16(), [tree(), busy_tree()], 0.1)


def test_unoptimized_waits_at_home(batch):
    plan = rule_plan(batch.graphs[0], batch.d_min_s[batch.rows[0]], 10.0)
    assert plan.post_waits_s[:-1].tolist() == [0.0, 0.0, 0.0]
    assert plan.post_waits_s[-1] == pytest.approx(10.0 - batch.least_cycles_s[0])
    assert plan.prior_waits_s.sum() == 0.0


def test_a_rule_refuses_a_cycle_time_below_the_least(batch):
    least = float(batch.least_cycles_s[0])
    with pytest.raises(CycleTimeTooShort, match=f"at least {least:.6f} s"):
        rule_plan(batch.graphs[0], batch.d_min_s[batch.rows[0]], 0.9 * least)


def test_uniform_is_one_speed_limit_that_just_fits(batch):
    times = batch.least_cycles_s[:, None] * np.array([1.0, 1.2, 50.0])
    limits = uniform_speed_limits(batch, times)
    for t, rows in enumerate(batch.rows):
        waits = batch.least_cycles_s[t] - batch.d_min_s[rows].sum()
        for r in (0, 1):
            total = batch.paths.durations(np.full((11, 1), limits[t, r]))[rows].sum() + waits
            assert total == pytest.approx(times[t, r], rel=1e-7)
            assert total <= times[t, r] + 1e-12
    assert limits[:, 2].tolist() == [0.1, 0.1]


def test_greedy_slows_the_steepest_first_and_the_last_partially(batch):
    graph = batch.graphs[0]
    runs = [
        sampled_profile([1.0, 1.2, 3.0], [100.0, 80.0, 150.0], [1.0, 0.5, 0.1]),  # 100 J/s
        sampled_profile([1.0, 1.5, 3.0], [300.0, 100.0, 150.0], [1.0, 0.5, 0.1]),  # 400 J/s
        sampled_profile([1.0, 2.0, 3.0], [100.0, 150.0, 190.0], [1.0, 0.5, 0.1]),  # best at full speed
        sampled_profile([1.0, 1.4, 3.0], [140.0, 100.0, 150.0], [1.0, 0.5, 0.1]),  # 100 J/s
    ]
    assert greedy_plan(graph, runs, 4.3).durations_s == pytest.approx([1.0, 1.3, 1.0, 1.0])
    assert greedy_plan(graph, runs, 4.6).durations_s == pytest.approx([1.1, 1.5, 1.0, 1.0])
    late = greedy_plan(graph, runs, 9.0)
    assert late.durations_s == pytest.approx([1.2, 1.5, 1.0, 1.4])
    assert late.post_waits_s == pytest.approx([0.0, 0.0, 0.0, 9.0 - 5.1])


def test_every_rule_plans_every_tree_at_every_cycle_time(batch):
    times = batch.least_cycles_s[:, None] * np.array([1.0, 1.3])
    limits = batch.speed_limits(6)
    runs = batch.paths.simulate(limits)
    greedy = Greedy(sampled_profiles(runs.duration_s, runs.energy_j, limits), 6)
    for method in (Unoptimized(), Uniform(), greedy):
        found = method.plan(batch, times)
        assert [[plan.cycle_time_s for plan in row] for row in found.plans] == times.tolist()
        assert found.costs is None
        assert found.runs_per_motion == (6 if method is greedy else 0)
    assert (Unoptimized().plan(batch, times).speed_limits == 1.0).all()
    uniform = Uniform().plan(batch, times).speed_limits
    assert [np.unique(uniform[rows, 1]).size for rows in batch.rows] == [1, 1]
