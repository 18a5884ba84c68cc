"""Plans of a study: the budget rule against the planning model, energies, tables."""

import numpy as np
import pytest

from reproduction.experiment.gaps import PlanEnergies, bootstrap_mean, gap_rows, win_rows
from reproduction.study.plans import evaluate_plans, path_costs, planned_speed_limits, polynomial_method
from robojoule.errors import CycleTimeTooShort
from robojoule.planning.chain import chain_plans
from robojoule.planning.costs import plan_energy_j
from robojoule.planning.optimum import DenseProfiles
from robojoule.planning.solver import PlanSolver
from robojoule.planning.writeback import stacked_durations
from tests.reproduction.study import cases


@pytest.fixture(scope="module")
def batch():
    return cases.batch(cases.plant(), 3, 9)


def test_the_budget_rule_gives_the_plans_of_the_planning_model(batch):
    costs = path_costs(batch, batch.paths, batch.speed_limits(25))
    times = batch.least_cycles_s[:, None] * [1.0, 1.1, 1.5, 3.0]
    for graph, of_tree, row in zip(batch.graphs, costs, times, strict=True):
        solver = PlanSolver(graph, of_tree)
        for plan in chain_plans(graph, of_tree, row):
            expected = solver.solve(plan.cycle_time_s)
            assert plan_energy_j(of_tree, plan) == pytest.approx(expected.energy_j, rel=1e-9)
            total = plan.durations_s.sum() + plan.prior_waits_s.sum() + plan.post_waits_s.sum()
            assert total == pytest.approx(plan.cycle_time_s)


def test_a_cycle_time_that_is_too_short_is_refused(batch):
    costs = path_costs(batch, batch.paths, batch.speed_limits(25))
    with pytest.raises(CycleTimeTooShort):
        chain_plans(batch.graphs[0], costs[0], batch.least_cycles_s[:1] * 0.9)


def test_planned_durations_are_kept(batch):
    costs = path_costs(batch, batch.paths, batch.speed_limits(25))
    times = batch.least_cycles_s[:, None] * [1.0, 1.2, 2.0]
    plans = [chain_plans(*case) for case in zip(batch.graphs, costs, times, strict=True)]
    found = batch.paths.durations(planned_speed_limits(batch, plans))
    wanted = stacked_durations(plans)
    assert (found <= wanted + 1e-9).all()
    np.testing.assert_allclose(found, wanted, atol=1e-6)


def test_no_method_beats_the_optimum(batch):
    limits = batch.speed_limits(25)
    methods = {
        "nominal_physics": path_costs(batch, batch.nominal_paths, limits),
        "krc_polynomial_6": polynomial_method(batch, 6),
    }
    plans = evaluate_plans(batch, methods, [100, 110, 150], 61)
    for method in plans.energy_j:
        assert (plans.gaps_percent(method) >= -0.01).all()
    # At the least cycle time there is nothing to choose.
    assert np.abs(plans.gaps_percent("nominal_physics")[:, 0]).max() < 1e-6
    assert (plans.gaps_percent("nominal_physics") < plans.gaps_percent("unoptimized"))[:, 1:].all()


def test_refined_points_are_those_of_the_plant(batch):
    dense = DenseProfiles(batch, 9)
    motions = np.array([1, len(batch.d_min_s) - 1])
    dense.refine(1.3 * batch.d_min_s[motions, None], motions)
    for motion in motions:
        found = dense.profiles[motion]
        assert len(found) > 9
        runs = batch.paths.simulate(np.tile(found.speed_limits, (batch.paths.motions, 1)))
        np.testing.assert_allclose(found.energies_j, runs.energy_j[motion], rtol=1e-9)


def test_tables_count_trees_wins_and_confidence():
    energies = {
        "unoptimized": np.array([[12.0], [12.0], [12.0]]),
        "robojoule_predicted": np.array([[10.1], [10.0], [13.0]]),
        "optimum": np.array([[10.0], [10.0], [10.0]]),
    }
    plans = PlanEnergies((110.0,), energies)
    row = next(row for row in gap_rows(plans, {}) if row["method"] == "robojoule_predicted")
    assert row["gap_mean_percent"] == pytest.approx(31 / 3, abs=1e-3)
    assert row["gap_worst_percent"] == 30.0
    assert row["above_unoptimized_percent"] == pytest.approx(100 / 3, abs=0.01)
    duel = next(r for r in win_rows(plans, {}) if (r["method"], r["other"]) == ("robojoule_predicted", "optimum"))
    assert (duel["wins"], duel["losses"]) == (0, 2)


def test_bootstrap_resamples_whole_groups():
    values = np.array([0.0, 0.0, 1.0, 1.0])
    assert bootstrap_mean(np.ones(5)) == (1.0, 1.0)
    by_tree, by_group = bootstrap_mean(values), bootstrap_mean(values, [0, 0, 1, 1])
    assert by_group[1] - by_group[0] >= by_tree[1] - by_tree[0]
