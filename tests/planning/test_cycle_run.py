"""Simulated cycles: what they add up to, checked against the runs and idle powers of their motions."""

import json

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import simulate_trees
from tests.core_cases import kr16
from tests.planning.trees import POINTS_DEG, busy_tree, tree

PARALLEL = {"rel": 1e-12}


@pytest.fixture(scope="module")
def batch():
    return TreeBatch(kr16(), [tree(), busy_tree()])


@pytest.fixture(scope="module")
def runs(batch):
    return [of_tree[0] for of_tree in simulate_trees(batch, [[one] for one in batch.trees])]


def test_a_cycle_without_waits_is_the_sum_of_its_motions(batch, runs):
    alone = batch.paths.simulate([1.0])
    rows = batch.rows[0]
    assert runs[0].energy_j == pytest.approx(alone.energy_j[rows].sum(), **PARALLEL)
    assert runs[0].cycle_time_s == pytest.approx(alone.duration_s[rows].sum(), **PARALLEL)
    assert runs[0].peak_power_w == alone.peak_power_w[rows].max()
    assert runs[0].peak_torque_ratio == alone.peak_torque_ratio[rows].max()
    assert runs[0].names == tuple(move.name for move in batch.trees[0].moves())


def test_waits_and_process_steps_are_paid_for(batch, runs):
    """0.2 s before the first move, 0.4 s welding with 500 W after it, 0.1 s at a later move."""
    alone, rows = batch.paths.simulate([1.0]), batch.rows[1]
    prior, post = batch.idle_prior_w[rows], batch.idle_post_w[rows]
    names = [move.name for move in batch.trees[1].moves()]
    standing = 0.2 * prior[0] + 0.4 * post[0] + 0.1 * post[names.index("stay too")]
    assert runs[1].energy_j == pytest.approx(alone.energy_j[rows].sum() + standing + 0.4 * 500.0, **PARALLEL)
    assert runs[1].cycle_time_s == pytest.approx(alone.duration_s[rows].sum() + 0.7, **PARALLEL)


@pytest.mark.parametrize("power_w", [0.0, 1e5])
@pytest.mark.parametrize("position", [0, 1])
def test_the_largest_power_may_be_that_of_a_process_step(power_w, position):
    """Before the first move the robot stands at the start, after it at its target."""
    weld = {"type": "process", "name": "weld", "duration_s": 0.1, "power_w": power_w}
    batch = TreeBatch(kr16(), [tree(extra=((position, weld),))])
    run = simulate_trees(batch, [batch.trees])[0][0]
    standing = batch.idle_prior_w[0] if position == 0 else batch.idle_post_w[0]
    expected = max(power_w + standing, batch.paths.simulate([1.0]).peak_power_w.max())
    assert run.peak_power_w == pytest.approx(expected, **PARALLEL)


def test_a_robot_that_only_stands_has_the_power_of_standing():
    """Moves of zero length with a wait."""
    batch = TreeBatch(kr16(), [tree(points=[(0.0, -90.0, 90.0, 0.0, 0.0, 0.0)])])
    (waiting,) = [one.with_plan({}, waits_after_s={"m0": 1.0}) for one in batch.trees]
    run = simulate_trees(batch, [[waiting]])[0][0]
    assert run.cycle_time_s == 1.0
    assert run.energy_j == pytest.approx(batch.idle_post_w[0], **PARALLEL)
    assert run.peak_power_w == pytest.approx(batch.idle_post_w[0], **PARALLEL)
    assert run.peak_torque_ratio == 0.0


def test_moves_and_plain_data_say_the_same(runs):
    run = runs[1]
    data = json.loads(json.dumps(run.to_dict(), allow_nan=False))
    assert [move["name"] for move in data["moves"]] == [move.name for move in run.moves] == list(run.names)
    assert [move.speed_limit_percent for move in run.moves] == [100.0] * len(run.names)
    assert sum(move["energy_j"] for move in data["moves"]) + 0.4 * 500.0 == pytest.approx(data["energy_j"])
    total = sum(move["duration_s"] + move["wait_before_s"] + move["wait_after_s"] for move in data["moves"])
    assert total == pytest.approx(data["cycle_time_s"])
    assert max(move["peak_torque_ratio"] for move in data["moves"]) == data["peak_torque_ratio"]
    assert repr(run).startswith(f"CycleRun(moves={len(run.names)}, cycle_time_s=")


def test_a_tree_that_goes_elsewhere_is_refused(batch):
    elsewhere = tree("there and back", points=np.array(POINTS_DEG) + 1.0)
    with pytest.raises(InputError, match="does not visit the configurations of 'there and back'"):
        simulate_trees(batch, [[elsewhere], [batch.trees[1]]])
