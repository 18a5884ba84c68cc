"""Plans of a study: methods on the plant, sources of profiles, tables."""

import numpy as np
import pytest

from reproduction.experiment.gaps import PlanEnergies, bootstrap_mean, gap_rows, win_rows
from reproduction.methods.method import Variant
from reproduction.methods.on_source import OnSource
from reproduction.study.methods import evaluate_plans, hull_profiles, polynomial_method
from robojoule.errors import CycleTimeTooShort
from robojoule.planning.cycle_run import simulate_trees
from robojoule.planning.solver import PlanSolver
from robojoule.planning.writeback import write_plans
from robojoule.profile.adaptive import AdaptiveProfiles
from tests.reproduction.study import cases


@pytest.fixture(scope="module")
def batch():
    return cases.batch(cases.plant(), 3, 9)


def nominal_physics(batch):
    return OnSource(Variant("nominal_physics"), hull_profiles(batch.nominal_paths, batch.speed_limits(25)))


def test_a_source_gives_the_plans_of_the_planning_model(batch):
    times = batch.least_cycles_s[:, None] * [1.0, 1.1, 1.5, 3.0]
    found = nominal_physics(batch).plan(batch, times)
    for graph, of_tree, plans in zip(batch.graphs, found.costs, found.plans, strict=True):
        solver = PlanSolver(graph, of_tree)
        for plan in plans:
            assert plan.energy_j == pytest.approx(solver.solve(plan.cycle_time_s).energy_j, rel=1e-9)
            total = plan.durations_s.sum() + plan.prior_waits_s.sum() + plan.post_waits_s.sum()
            assert total == pytest.approx(plan.cycle_time_s)


def test_a_cycle_time_that_is_too_short_is_refused(batch):
    with pytest.raises(CycleTimeTooShort):
        nominal_physics(batch).plan(batch, batch.least_cycles_s[:, None] * 0.9)


def test_plans_are_kept_on_the_plant(batch):
    times = batch.least_cycles_s[:, None] * [1.0, 1.2, 2.0]
    plans = nominal_physics(batch).plan(batch, times).plans
    for runs, of_tree in zip(simulate_trees(batch, write_plans(batch, plans)), plans, strict=True):
        for run, plan in zip(runs, of_tree, strict=True):
            np.testing.assert_allclose(run.durations_s, plan.durations_s, atol=1e-6)
            assert run.cycle_time_s == pytest.approx(plan.cycle_time_s, abs=1e-9)


def test_no_method_beats_the_optimum(batch):
    methods = {"nominal_physics": nominal_physics(batch), "krc_polynomial_6": polynomial_method(batch, 6, 15.0)}
    plans = evaluate_plans(batch, methods, [100, 110, 150], 61)
    assert list(plans.energy_j) == ["unoptimized", "uniform", "greedy", *methods, "optimum"]
    for method in plans.energy_j:
        assert (plans.gaps_percent(method) >= -0.01).all()
    # At the least cycle time there is nothing to choose.
    assert np.abs(plans.gaps_percent("nominal_physics")[:, 0]).max() < 1e-6
    assert (plans.gaps_percent("nominal_physics") < plans.gaps_percent("unoptimized"))[:, 1:].all()


def test_refined_runs_are_those_of_the_plant(batch):
    profiles = AdaptiveProfiles(batch.paths, batch.slowest_speed_limit, 9)
    motions = [1, len(batch.d_min_s) - 1]
    assert profiles.refine_near({motion: 1.3 * batch.d_min_s[motion : motion + 1] for motion in motions}) == motions
    for motion in motions:
        found = profiles.profiles[motion]
        assert len(found) == 10
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
