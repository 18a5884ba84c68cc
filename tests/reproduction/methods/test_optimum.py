"""The optimum: proven, met by the simulation, and not beaten by brute force."""

import itertools

import numpy as np
import pytest

from reproduction.methods.optimum import TARGET_GAP, Optimum
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import simulate_trees
from robojoule.planning.writeback import write_plans
from tests.core_cases import kr16
from tests.planning.trees import busy_tree, dense_plans, tree


@pytest.fixture(scope="module")
def batch():
    return TreeBatch(kr16(), [tree(), busy_tree()], 0.1)


@pytest.fixture(scope="module")
def times(batch):
    return batch.least_cycles_s[:, None] * np.array([1.0, 1.15, 1.6])


@pytest.fixture(scope="module")
def optimum(batch, times):
    return Optimum(91).plan(batch, times).plans


def test_the_gap_is_proven_and_closed(batch, optimum):
    runs = simulate_trees(batch, write_plans(batch, optimum))
    for t, row in enumerate(optimum):
        for k, plan in enumerate(row):
            assert plan.bound_j <= plan.energy_j * (1 + 1e-12)
            assert runs[t][k].energy_j <= plan.bound_j * (1 + 1e-4)
            assert runs[t][k].energy_j >= plan.bound_j * (1 - 1e-7)


def test_no_grid_of_speed_limits_is_better(batch, times, optimum):
    rows = batch.rows[0]
    grid = np.linspace(0.1, 1.0, 26)
    runs = batch.paths.simulate(np.broadcast_to(grid, (11, grid.size)))
    d, e = runs.duration_s[rows], runs.energy_j[rows]
    idle = min(batch.idle_post_w[rows])
    for k in (1, 2):
        best = np.inf
        for choice in itertools.product(range(grid.size), repeat=2):
            two = d[0, choice[0]] + d[1, choice[1]]
            left = times[0, k] - two - d[2][:, None] - d[3][None, :]
            energy = e[0, choice[0]] + e[1, choice[1]] + e[2][:, None] + e[3][None, :] + idle * left
            best = min(best, float(np.where(left >= 0.0, energy, np.inf).min()))
        assert optimum[0][k].bound_j <= best
        assert optimum[0][k].energy_j <= best * (1 + 1e-6)


def test_the_planning_model_on_many_chords_finds_nothing_better(batch, times, optimum):
    for row, others in zip(optimum, dense_plans(batch, times, 401), strict=True):
        for plan, other in zip(row, others, strict=True):
            assert plan.bound_j <= other.energy_j * (1 + 1e-7)
            assert plan.energy_j <= other.energy_j * (1 + TARGET_GAP)


def test_more_runs_than_to_begin_with_are_counted(batch, times):
    found = Optimum(21).plan(batch, times)
    assert found.runs_per_motion > 21 * batch.paths.moving.mean()
    assert len(found.costs) == 2
