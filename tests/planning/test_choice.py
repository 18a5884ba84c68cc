"""One option of each class within a budget: against brute force and another solver."""

import itertools

import numpy as np
import pytest
from scipy.optimize import Bounds, LinearConstraint, milp

from robojoule.planning.choice import least_cost_choice, within_gap


def case(rng, count, options):
    """Classes with profiles that need not be convex, and a budget between their fastest and slowest options."""
    durations, costs = [], []
    for _ in range(count):
        d = rng.uniform(0.3, 3.0, rng.integers(1, options + 1))
        durations.append(d)
        costs.append(rng.uniform(100, 500) / d + rng.uniform(-50, 300) * d + rng.normal(0, 5, d.size))
    least, most = sum(d.min() for d in durations), sum(d.max() for d in durations)
    return durations, costs, rng.uniform(least, 1.05 * most)


def totals(durations, costs, budget):
    """Costs of all choices that fit."""
    for options in itertools.product(*[range(d.size) for d in durations]):
        if sum(d[k] for d, k in zip(durations, options, strict=True)) <= budget:
            yield sum(c[k] for c, k in zip(costs, options, strict=True))


@pytest.mark.parametrize("seed", range(60))
def test_no_other_choice_costs_less(seed):
    rng = np.random.default_rng(seed)
    durations, costs, budget = case(rng, int(rng.integers(1, 5)), 10)
    found = least_cost_choice(durations, costs, budget, tolerance_j=1e-9)
    best = min(totals(durations, costs, budget))
    assert found.cost_j == pytest.approx(best, abs=1e-7)
    assert found.bound_j <= best + 1e-9
    chosen = list(zip(durations, costs, found.options, strict=True))
    assert sum(c[k] for _, c, k in chosen) == pytest.approx(found.cost_j)
    assert sum(d[k] for d, _, k in chosen) <= budget + 1e-9


@pytest.mark.parametrize("count", [12, 40])
def test_another_solver_finds_nothing_better(count):
    durations, costs, budget = case(np.random.default_rng(count), count, 30)
    tolerance = 1e-6 * sum(np.abs(c).mean() for c in costs)
    found = least_cost_choice(durations, costs, budget, tolerance_j=tolerance)
    sizes = [d.size for d in durations]
    one_of_each = np.repeat(np.eye(count), sizes, axis=1)
    solution = milp(
        np.concatenate(costs),
        constraints=[LinearConstraint(one_of_each, 1, 1), LinearConstraint(np.concatenate(durations), ub=budget)],
        integrality=np.ones(sum(sizes)),
        bounds=Bounds(0, 1),
        options={"mip_rel_gap": 1e-9, "time_limit": 30},
    )
    assert found.cost_j <= solution.fun + tolerance
    assert found.bound_j <= solution.fun + 1e-6


def test_a_budget_below_the_fastest_has_no_choice():
    assert least_cost_choice([np.array([1.0, 2.0])], [np.array([5.0, 1.0])], 0.99, tolerance_j=0.1) is None


@pytest.mark.parametrize("seed", range(10))
def test_what_a_known_choice_leaves_open_holds_all_better_ones(seed):
    rng = np.random.default_rng(seed)
    durations, costs, budget = case(rng, 3, 8)
    known = float(rng.choice(sorted(totals(durations, costs, budget))[:5]))
    left = within_gap(durations, costs, budget, cost_j=known)
    for options in itertools.product(*[range(d.size) for d in durations]):
        fits = sum(d[k] for d, k in zip(durations, options, strict=True)) <= budget
        if fits and sum(c[k] for c, k in zip(costs, options, strict=True)) < known:
            assert all(k in open_ for k, open_ in zip(options, left, strict=True))
