"""Random operation trees (thesis 4.1, Algorithm 1): points at a budgeted joint distance, visited and retraced.

A tree starts at HOME, visits the random points one after another and goes back through them to HOME, so that every
motion also exists in reverse. Each point is drawn from the one before it: Algorithm 1 changes the joints in place.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.robots.collision import CollisionModel
from robojoule.robots.robot import Robot

MOST_DRAWS = 5000


def draw_point(
    rng: np.random.Generator,
    joints_rad: ArrayLike,
    budget_rad: float,
    lower_rad: ArrayLike,
    upper_rad: ArrayLike,
    *,
    use_whole_budget: bool = True,
) -> Array:
    """Draw one point (Algorithm 1, lines 3-13).

    The budget is distributed over the joints uniformly (a flat Dirichlet distribution). With the whole budget, each
    joint moves by its share up or down; otherwise by a uniform random part of it. Both are clamped to the limits.

    Args:
        rng: Random generator.
        joints_rad: Joint positions to start from, shape (n,). [rad]
        budget_rad: Largest sum of the changes of all joints (B). [rad]
        lower_rad: Lower joint limits, shape (n,). [rad]
        upper_rad: Upper joint limits, shape (n,). [rad]
        use_whole_budget: Whether the changes add up to the budget (unless clamped) or to less.

    Returns:
        Joint positions, shape (n,). [rad]
    """
    joints = np.asarray(joints_rad, dtype=float)
    shares = budget_rad * rng.dirichlet(np.ones(len(joints)))
    if use_whole_budget:
        changes = np.where(rng.random(len(joints)) < 0.5, shares, -shares)
    else:
        changes = rng.uniform(-shares, shares)
    return np.asarray(np.clip(joints + changes, lower_rad, upper_rad))


def draw_points(
    rng: np.random.Generator,
    robot: Robot,
    collisions: CollisionModel,
    *,
    points: int,
    budget_rad: float,
    use_whole_budget: bool = True,
) -> tuple[Array, int]:
    """Draw points one after another from HOME on; those in collision, or behind a path in collision, are drawn again.

    Args:
        rng: Random generator.
        robot: Robot; its HOME is the first start.
        collisions: Its collision model.
        points: Number of points (n of Algorithm 1).
        budget_rad: Largest sum of the changes of all joints from point to point (B). [rad]
        use_whole_budget: See `draw_point`.

    Returns:
        The points, shape (points, joints) [rad], and the number of draws it took.

    Raises:
        InputError: HOME is in collision, or no free point is found in 5000 draws.
    """
    hit = collisions.first_collision(robot.home_rad)
    if hit is not None:
        raise InputError(f"{robot.name} is in collision at HOME: {hit[0]} touches {hit[1]}")
    found = [np.asarray(robot.home_rad, dtype=float)]
    draws = 0
    for _ in range(points):
        for _ in range(MOST_DRAWS):
            draws += 1
            point = draw_point(
                rng, found[-1], budget_rad, robot.lower_rad, robot.upper_rad, use_whole_budget=use_whole_budget
            )
            if not collisions.path_collides(found[-1], point):
                found.append(point)
                break
        else:
            raise InputError(
                f"no collision-free point found in {MOST_DRAWS} draws with a budget of {budget_rad:.4g} rad",
                key="budget_rad",
                allowed="a smaller budget",
            )
    return np.array(found[1:]), draws


def retrace(home_rad: ArrayLike, points_rad: ArrayLike) -> Array:
    """Visit the points from HOME and go back through them: HOME, p0 .. pn, .. p0, HOME.

    Args:
        home_rad: Joint positions, shape (n,). [rad]
        points_rad: Shape (points, n). [rad]

    Returns:
        Shape (2 points + 1, n). [rad]
    """
    outward = np.vstack([np.asarray(home_rad, dtype=float), np.asarray(points_rad, dtype=float)])
    return np.vstack([outward, outward[-2::-1]])


def joint_travel_rad(configurations_rad: ArrayLike) -> float:
    """Sum of the absolute joint changes along a sequence of configurations, shape (P, n). [rad]"""
    return float(np.abs(np.diff(np.asarray(configurations_rad, dtype=float), axis=0)).sum())


def generate_configurations(
    robot: Robot,
    collisions: CollisionModel,
    *,
    seed: int | np.random.SeedSequence,
    budgets_rad: ArrayLike,
    points: int,
    use_whole_budget: bool = True,
) -> Iterator[tuple[Array, int]]:
    """Generate one retraced sequence of configurations per budget.

    Every tree has a random stream of its own, so it does not change if others are added behind it.

    Args:
        robot: Robot.
        collisions: Its collision model.
        seed: Seed of all trees.
        budgets_rad: Budget of each tree, shape (T,). [rad]
        points: Random points per tree.
        use_whole_budget: See `draw_point`.

    Yields:
        Configurations, shape (2 points + 1, n) [rad], and the number of draws, tree by tree.

    Raises:
        InputError: See `draw_points`.
    """
    sequence = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    budgets = np.asarray(budgets_rad, dtype=float)
    for child, budget in zip(sequence.spawn(len(budgets)), budgets, strict=True):
        found, draws = draw_points(
            np.random.default_rng(child),
            robot,
            collisions,
            points=points,
            budget_rad=float(budget),
            use_whole_budget=use_whole_budget,
        )
        yield retrace(robot.home_rad, found), draws
