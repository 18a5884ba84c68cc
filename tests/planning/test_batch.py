"""Batches of trees: the order of their motions, least cycles, speed limits, what is refused."""

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.formats.tree_files import parse_tree, tree_to_data
from robojoule.planning.batch import TreeBatch
from tests.core_cases import kr16
from tests.planning.trees import busy_tree, tree


@pytest.fixture(scope="module")
def batch():
    return TreeBatch(kr16(), [tree(), busy_tree()])


def test_motions_stand_tree_after_tree(batch):
    assert [rows.stop - rows.start for rows in batch.rows] == [4, 7]
    assert batch.d_min_s[4] == pytest.approx(batch.d_min_s[0])
    assert (batch.d_max_s >= batch.d_min_s).all()
    stay = [i + 4 for i, v in enumerate(batch.graphs[1].vertices) if v.name.startswith("stay")]
    assert batch.d_max_s[stay].min() == 0.0
    assert batch.least_cycles_s[1] == pytest.approx(batch.d_min_s[batch.rows[1]].sum() + 0.2 + 0.4 + 0.1)


def test_predecessors_close_the_cycle(batch):
    before = batch.predecessors(np.arange(11.0))
    assert before.tolist() == [3.0, 0.0, 1.0, 2.0, 10.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]
    assert batch.predecessors(batch.idle_post_w) == pytest.approx(batch.idle_prior_w)


def test_saturating_speed_limits_give_the_fastest_run_and_lower_ones_do_not(batch):
    top = batch.saturating_speed_limits[:, None]
    assert batch.paths.durations(top)[:, 0] == pytest.approx(batch.d_min_s, rel=1e-9)
    slower = batch.paths.durations(np.maximum(0.9 * top, 0.1))[:, 0]
    moving = batch.paths.moving & (top[:, 0] > 0.12)
    assert (slower[moving] > batch.d_min_s[moving]).all()


def test_moves_through_coarse_zones_are_one_motion():
    data = tree_to_data(tree())
    data["operations"][1]["zone"] = {"radius_m": 0.1}
    data["operations"][1]["speed_limit_percent"] = 60
    data["operations"][2]["least_speed_percent"] = 30
    batch = TreeBatch(kr16(), [parse_tree(data, "coarse"), tree()])
    assert [rows.stop - rows.start for rows in batch.rows] == [3, 4]
    assert [bound[1] for bound in batch.speed_range] == [0.01, 1.0]
    assert batch.d_min_s[3:] == pytest.approx(TreeBatch(kr16(), [tree()]).d_min_s, rel=1e-12)
    with pytest.raises(InputError, match="move 'm1' has a coarse zone: cells of robots"):
        batch.paths  # noqa: B018


def test_moves_of_a_speed_group_count_once():
    data = tree_to_data(tree())
    for move in (0, 2):
        data["operations"][move] |= {"speed_group": "there", "speed_limit_percent": 70}
    batch, alone = TreeBatch(kr16(), [parse_tree(data, "tied")]), TreeBatch(kr16(), [tree()])
    assert batch.leaders.tolist() == [0, 1, 0, 3]
    limits = np.array([0.3, 0.5, 0.9, 0.7])[:, None]
    each = alone.planned.durations(limits[batch.leaders])[:, 0]
    assert batch.planned.durations(limits)[:, 0] == pytest.approx([each[0] + each[2], each[1], 0.0, each[3]])
    assert batch.speed_range[1].tolist() == [0.7, 1.0, 0.7, 1.0]
