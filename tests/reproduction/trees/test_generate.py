from itertools import pairwise

import numpy as np
import pytest

from reproduction.trees.generate import (
    draw_point,
    draw_points,
    generate_configurations,
    joint_travel_rad,
    retrace,
)
from robojoule.errors import InputError
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.programs.tree_check import check_tree
from robojoule.robots import load_robot
from robojoule.robots.collision import CollisionModel
from robojoule.robots.robot import Payload

WIDE = np.full(6, 1e3)


@pytest.fixture(scope="module")
def robot():
    return load_robot("kuka_kr16_r2010_2", Payload(10.0))


@pytest.fixture(scope="module")
def collisions(robot):
    return CollisionModel(robot)


def generate(robot, collisions, seed=3, budgets=(0.8, 2.0, 4.0), **options):
    found = generate_configurations(
        robot, collisions, seed=seed, budgets_rad=budgets, points=options.pop("points", 5), **options
    )
    return [configurations for configurations, _ in found]


@pytest.mark.parametrize("budget", [0.0, 0.3, 4.0])
def test_whole_budget_is_used_up(budget):
    rng = np.random.default_rng(1)
    for _ in range(200):
        start = rng.normal(size=6)
        change = draw_point(rng, start, budget, -WIDE, WIDE) - start
        assert np.abs(change).sum() == pytest.approx(budget, abs=1e-12)


def test_part_of_the_budget_stays_below_it():
    rng = np.random.default_rng(1)
    sums = [np.abs(draw_point(rng, np.zeros(6), 2.0, -WIDE, WIDE, use_whole_budget=False)).sum() for _ in range(2000)]
    assert max(sums) <= 2.0
    # Each share (mean B/6) is used up to a uniform part of it (mean 1/2).
    assert np.mean(sums) == pytest.approx(1.0, abs=0.02)


def test_directions_are_fair_coins_and_shares_are_even():
    rng = np.random.default_rng(2)
    changes = np.array([draw_point(rng, np.zeros(6), 1.0, -WIDE, WIDE) for _ in range(4000)])
    np.testing.assert_allclose((changes > 0).mean(axis=0), 0.5, atol=0.03)
    np.testing.assert_allclose(np.abs(changes).mean(axis=0), 1 / 6, atol=0.01)
    # A flat Dirichlet share of six has the variance (1/6)(5/6)/7.
    np.testing.assert_allclose(np.abs(changes).var(axis=0), 5 / 252, atol=0.002)


@pytest.mark.parametrize("whole", [True, False])
def test_points_are_clamped_to_the_limits(whole):
    rng = np.random.default_rng(1)
    lower, upper = np.full(3, -0.1), np.full(3, 0.2)
    points = np.array([draw_point(rng, np.zeros(3), 5.0, lower, upper, use_whole_budget=whole) for _ in range(300)])
    assert points.min() == -0.1
    assert points.max() == 0.2


def test_retracing_mirrors_the_way():
    way = retrace([0, 0], [[1, 0], [1, 1], [2, 1]])
    assert way.tolist() == [[0, 0], [1, 0], [1, 1], [2, 1], [1, 1], [1, 0], [0, 0]]
    np.testing.assert_array_equal(way, way[::-1])
    assert joint_travel_rad(way) == 6


@pytest.mark.parametrize("whole", [True, False])
def test_trees_keep_budget_limits_and_stay_free(robot, collisions, whole):
    for budget, way in zip((0.8, 2.0, 4.0), generate(robot, collisions, use_whole_budget=whole), strict=True):
        assert way.shape == (11, 6)
        np.testing.assert_array_equal(way[[0, -1]], [robot.home_rad, robot.home_rad])
        sums = np.abs(np.diff(way, axis=0)).sum(axis=1)
        clamped = np.any((way[1:] == robot.lower_rad) | (way[1:] == robot.upper_rad), axis=1)
        assert np.all(sums <= budget + 1e-12)
        if whole:
            assert not clamped.any()
            np.testing.assert_allclose(sums, budget, rtol=1e-12)
        for start, end in pairwise(way):
            fine = start + np.linspace(0, 1, 301)[:, None] * (end - start)
            # The path is checked every 2 degrees: between two checks a surface moves by less than 0.1 m.
            assert collisions.clearances_m(fine).min() > -0.05
        check_tree(tree_from_configurations("t", way, robot.name), robot)


def test_same_seed_same_trees(robot, collisions):
    np.testing.assert_array_equal(generate(robot, collisions), generate(robot, collisions))
    assert not np.array_equal(generate(robot, collisions), generate(robot, collisions, seed=4))


def test_trees_do_not_depend_on_each_other(robot, collisions):
    both = generate(robot, collisions, budgets=(4.0, 2.0))
    np.testing.assert_array_equal(generate(robot, collisions, budgets=(4.0,))[0], both[0])
    np.testing.assert_array_equal(generate(robot, collisions, budgets=(0.8, 2.0))[1], both[1])


def test_each_point_starts_from_the_one_before(robot, collisions):
    rng = np.random.default_rng(5)
    points, draws = draw_points(rng, robot, collisions, points=4, budget_rad=1.0)
    steps = np.abs(np.diff(np.vstack([robot.home_rad, points]), axis=0)).sum(axis=1)
    np.testing.assert_allclose(steps, 1.0, rtol=1e-12)
    assert draws >= 4


@pytest.mark.parametrize("budget", [0.8, 2.4, 4.0])
def test_a_good_share_of_drawn_points_is_free(robot, collisions, budget):
    ways = generate_configurations(robot, collisions, seed=1, budgets_rad=[budget] * 30, points=5)
    draws = sum(count for _, count in ways)
    assert 150 / draws > 0.3


def test_home_in_collision_is_said_so(robot):
    class Blocked(CollisionModel):
        def first_collision(self, q):
            return ("link_4", "the floor")

    with pytest.raises(InputError, match="is in collision at HOME: link_4 touches the floor"):
        draw_points(np.random.default_rng(0), robot, Blocked(robot), points=1, budget_rad=1.0)


def test_hopeless_budget_is_said_so(robot, monkeypatch):
    class Narrow(CollisionModel):
        def path_collides(self, start_rad, end_rad, step_rad=0.1):
            return True

    monkeypatch.setattr("reproduction.trees.generate.MOST_DRAWS", 20)
    with pytest.raises(InputError, match="budget_rad: no collision-free point found in 20 draws"):
        draw_points(np.random.default_rng(0), robot, Narrow(robot), points=1, budget_rad=1.0)
