"""Energy over cycle time: against the solver, brute force and closed forms; plans from few runs against the optimum."""

import numpy as np
import pytest

from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.costs import VertexCosts
from robojoule.planning.graph import OptimizationGraph
from robojoule.planning.pareto import pareto_curve, trade_offs
from robojoule.planning.solver import PlanSolver
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload
from tests.planning.cases import analytic, costs_of, one_robot, ring
from tests.planning.trees import busy_tree, dense_plans, tree

IDLE_W = [430.0, 415.0, 440.0, 425.0, 460.0]


@pytest.mark.parametrize("seed", range(3))
def test_the_solver_finds_the_same_energy_at_twenty_cycle_times(seed):
    graph = one_robot(5, waits={1: (0.3, 0.0), 3: (0.0, 0.7)})
    costs = costs_of([one.chords(7) for one in analytic(5, seed)], IDLE_W)
    curve, solver = pareto_curve(graph, costs), PlanSolver(graph, costs)
    times = curve.cycle_times_s[0] * np.linspace(1.0, 5.5, 20)
    assert times[-1] > curve.cycle_times_s[-1]  # where all further time is waited
    for time in times.tolist():
        assert float(curve.energy_j(time)) == pytest.approx(solver.solve(time).energy_j, rel=1e-9)


def test_the_curve_is_convex_and_ends_where_more_time_is_waited():
    graph, costs = one_robot(5), costs_of([one.chords(30) for one in analytic(5, 2)], IDLE_W)
    curve = pareto_curve(graph, costs)
    assert (np.diff(curve.cycle_times_s) > 0.0).all()
    assert (np.diff(curve.marginal_powers_w) >= 0.0).all()
    slopes = np.diff(curve.energies_j) / np.diff(curve.cycle_times_s)
    assert slopes == pytest.approx(curve.marginal_powers_w[:-1])
    assert curve.cycle_times_s[0] == pytest.approx(sum(cost.profile.d_min_s for cost in costs))
    assert curve.energies_j[0] == pytest.approx(sum(cost.profile.energies_j[0] for cost in costs))
    assert curve.marginal_powers_w[-1] == min(IDLE_W)
    assert curve.energies_j[curve.best] == pytest.approx(sum(cost.profile.energies_j.min() for cost in costs))
    assert curve.marginal_powers_w[curve.best] >= 0.0 > curve.marginal_powers_w[curve.best - 1]
    assert curve.hull_excess_j.max() == 0.0


def test_durations_at_a_cycle_time_make_up_its_energy():
    costs = costs_of([one.chords(9) for one in analytic(5, 4)], IDLE_W)
    curve = pareto_curve(one_robot(5), costs)
    times = np.linspace(curve.cycle_times_s[0], 1.2 * curve.cycle_times_s[-1], 17)
    for time, durations in zip(times, curve.plan_durations_s(times), strict=True):
        energy = sum(float(cost.profile.value(d)) for cost, d in zip(costs, durations, strict=True))
        waited = time - durations.sum()
        assert waited >= -1e-9
        assert float(curve.energy_j(time)) == pytest.approx(energy + min(IDLE_W) * waited, rel=1e-9)


def test_brute_force_on_two_motions():
    profiles = [one.chords(6) for one in analytic(2, 9)]
    costs = costs_of(profiles, [430.0, 415.0])
    curve = pareto_curve(one_robot(2), costs)
    first = np.union1d(profiles[0].durations_s, np.linspace(profiles[0].d_min_s, profiles[0].d_max_s, 4000))
    for time in np.linspace(curve.cycle_times_s[0], 1.1 * curve.cycle_times_s[-1], 15):
        # In a best plan both durations stand at breakpoints, or one of them takes all the time that is left.
        left = np.clip(time - profiles[1].durations_s, profiles[0].d_min_s, profiles[0].d_max_s)
        tried = np.union1d(first, left)
        options = [np.full(tried.size, d) for d in profiles[1].durations_s]
        options.append(np.clip(time - tried, profiles[1].d_min_s, profiles[1].d_max_s))
        best = np.inf
        for second in options:
            wait = time - tried - second
            energy = profiles[0].value(tried) + profiles[1].value(second) + 415.0 * wait
            best = min(best, energy[wait >= -1e-9].min(initial=np.inf))
        assert float(curve.energy_j(time)) == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_where_profiles_are_not_convex_the_difference_is_stated(seed):
    rng = np.random.default_rng(seed)
    d = np.linspace(0.5, 1.5, 8)
    profiles = [PiecewiseLinearProfile(d, 300.0 - 150.0 * d + rng.uniform(0, 60, 8)) for _ in range(3)]
    graph, costs = one_robot(3), costs_of(profiles, [300.0] * 3)
    curve, solver = pareto_curve(graph, costs), PlanSolver(graph, costs)
    assert curve.hull_excess_j.max() > 0.0
    for segment in range(curve.cycle_times_s.size - 1):
        start, end = curve.cycle_times_s[segment : segment + 2].tolist()
        assert solver.solve(start).energy_j == pytest.approx(curve.energies_j[segment], rel=1e-8)
        middle = (start + end) / 2.0
        above = solver.solve(middle).energy_j - float(curve.energy_j(middle))
        assert -1e-6 <= above <= curve.hull_excess_j[segment] + 1e-6


def test_motions_of_zero_length_and_a_curve_without_trade_off():
    still = PiecewiseLinearProfile([0.0], [0.0])
    curve = pareto_curve(one_robot(1), [VertexCosts(still, 400.0, 390.0)])
    assert curve.cycle_times_s.tolist() == [0.0]
    assert curve.marginal_powers_w.tolist() == [390.0]
    assert float(curve.energy_j(2.0)) == 780.0


def test_bad_questions_are_refused():
    costs = costs_of([one.chords(3) for one in analytic(2)], [430.0, 430.0])
    curve = pareto_curve(one_robot(2), costs)
    with pytest.raises(CycleTimeTooShort, match="shorter than the fastest cycle"):
        curve.energy_j(0.1)
    with pytest.raises(CycleTimeTooShort):
        curve.energy_j(float("nan"))
    a, b = ring(1, "a", "a"), ring(1, "b", "b")
    with pytest.raises(InputError, match="one robot only"):
        pareto_curve(OptimizationGraph(a[0] + b[0], a[1] + b[1]), costs)
    with pytest.raises(ValueError, match="read-only"):
        curve.energies_j[0] = 0.0


@pytest.fixture(scope="module")
def batch():
    robot = load_robot("kuka_kr16_r2010_2", Payload(10.0, (0.0, 0.0, 0.1)))
    return TreeBatch(robot, [tree(), busy_tree()])


def test_trees_are_enclosed_by_curve_and_bound(batch):
    times = batch.least_cycles_s[:, None] * np.array([1.05, 1.3, 2.0, 4.0])
    best = dense_plans(batch, times, 181)
    for number, found in enumerate(trade_offs(batch)):
        assert found.curve.cycle_times_s[0] == pytest.approx(batch.least_cycles_s[number])
        assert 0.0 < found.largest_gap < 1e-3
        optimum = np.array([plan.energy_j for plan in best[number]])
        assert (found.bound.energy_j(times[number]) <= optimum).all()
        assert found.curve.energy_j(times[number]) == pytest.approx(optimum, rel=5e-4)
        assert found.runs < 130 * len(batch.trees[number].moves())
