"""Clearance between two arms: against coal, against dense sampling, and bounds that hold."""

import numpy as np
import pytest

from robojoule.robots import load_robot
from robojoule.robots.clearance import (
    RESOLUTION_M,
    SWEPT_RESOLUTION_M,
    Courses,
    PlacedArm,
    TimedCourses,
    come_close,
    gaps_m,
    least_clearance,
)
from robojoule.robots.rigid_body import Placement

LEAST_M = 0.05


@pytest.fixture(scope="module")
def arms():
    first = PlacedArm(load_robot("kuka_kr6_r900_2", payload_kg=3), Placement.identity())
    second = PlacedArm(load_robot("ur_ur5e", payload_kg=2), Placement.of([0.8, 0.2, 0.1], (0.1, 0.0, 2.5)))
    return first, second


def courses(arm: PlacedArm, robot: str, count: int, seed: int) -> Courses:
    file, rng = load_robot(robot), np.random.default_rng(seed)
    low, high = np.maximum(file.lower_rad, -2.0), np.minimum(file.upper_rad, 2.0)
    ends = rng.uniform(low, high, (2, count, 6))
    ends[1, 0] = ends[0, 0]  # one that stands still
    return Courses(ends[0], ends[1] - ends[0])


@pytest.fixture(scope="module")
def ways(arms):
    return courses(arms[0], "kuka_kr6_r900_2", 8, 1), courses(arms[1], "ur_ur5e", 8, 2)


def test_gaps_against_coal(arms):
    coal = pytest.importorskip("coal")
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(5)
    q, p = rng.uniform(-1.5, 1.5, (2, 20, 6))
    found = gaps_m(arms[0], q, arms[1], p)

    def shapes(arm, configurations):
        segments = arm.segments_m(configurations)
        for k, radius in enumerate(arm.model.radii_m):
            rows = []
            for ends in np.moveaxis(segments[k], 1, 0):
                length = float(np.linalg.norm(ends[1] - ends[0]))
                way = (ends[1] - ends[0]) / length if length > 0 else np.array([0, 0, 1.0])
                turn = pin.Quaternion.FromTwoVectors(np.array([0, 0, 1.0]), way).matrix()
                rows.append((coal.Capsule(radius, length), coal.Transform3s(turn, ends.mean(axis=0))))
            yield rows

    for k, first in enumerate(shapes(arms[0], q)):
        for j, second in enumerate(shapes(arms[1], p)):
            for row in range(len(q)):
                result = coal.DistanceResult()
                coal.distance(*first[row], *second[row], coal.DistanceRequest(), result)
                if result.min_distance > 0:
                    assert found[k, j, row] == pytest.approx(result.min_distance, abs=1e-4)
                else:
                    assert found[k, j, row] <= 1e-4


def test_no_capsule_moves_further_than_is_said(arms):
    """Oracle: the forward kinematics of random configurations."""
    rng = np.random.default_rng(7)
    for arm in arms:
        start = rng.uniform(-2.0, 2.0, (200, 6))
        delta = rng.normal(0.0, 0.3, (200, 6)) * (rng.random((200, 6)) < 0.4)
        bound = arm.travel_m(Courses(start, delta))
        moved = np.linalg.norm(arm.segments_m(start + delta) - arm.segments_m(start), axis=-1).max(axis=1).T
        assert (moved <= bound + 1e-12).all()
        assert (moved > 0.2 * bound)[bound > 0].mean() > 0.3  # and the bound is not idle


def dense_least(arms, first: Courses, i: int, second: Courses, j: int, steps: int = 41) -> float:
    s, t = (part.ravel() for part in np.meshgrid(*[np.linspace(0.0, 1.0, steps)] * 2))
    q = first.start_rad[i] + s[:, None] * first.delta_rad[i]
    p = second.start_rad[j] + t[:, None] * second.delta_rad[j]
    return float(gaps_m(arms[0], q, arms[1], p).min())


def test_swept_courses_against_dense_sampling(arms, ways):
    close = come_close(arms[0], ways[0], arms[1], ways[1], LEAST_M)
    assert 0.1 < close.mean() < 0.9  # both kinds are there
    for i, j in np.ndindex(close.shape):
        least = dense_least(arms, ways[0], i, ways[1], j)
        if close[i, j]:
            assert least < LEAST_M + SWEPT_RESOLUTION_M + 0.03  # what the grid may miss
        else:
            assert least >= LEAST_M


def test_a_passing_arm_is_found_between_samples(arms):
    """Both courses start and end far apart and cross in a short part of their way."""
    home = np.radians([0, -90, 90, 0, 0, 0])
    swing = np.radians([170.0, 0, 0, 0, 0, 0])
    first = Courses((home - swing / 2)[None], swing[None])
    twin = PlacedArm(load_robot("kuka_kr6_r900_2", payload_kg=3), Placement.of([1.2, 0.0, 0.0], (0.0, 0.0, np.pi)))
    ends = np.array([home - swing / 2, home + swing / 2])
    assert gaps_m(arms[0], ends, twin, ends).min() > 0.5
    assert come_close(arms[0], first, twin, first, 0.0)[0, 0]


@pytest.mark.parametrize("seed", range(4))
def test_clearance_over_time_is_bounded_closely_from_below(arms, seed):
    """Oracle: a fine grid of times."""
    ways = courses(arms[0], "kuka_kr6_r900_2", 5, 10 + seed), courses(arms[1], "ur_ur5e", 3, 20 + seed)
    rng = np.random.default_rng(seed)
    timed = []
    for arm, way in zip(arms, ways, strict=True):
        ends = np.sort(rng.uniform(0.2, 5.0, len(way)))
        ends[-1] = 5.0
        starts = np.append(0.0, ends[:-1])

        def places(pieces, time, starts=starts, ends=ends):
            share = np.clip((time - starts[pieces]) / (ends[pieces] - starts[pieces]), 0.0, 1.0)
            return share**2 * (3.0 - 2.0 * share)

        timed.append(TimedCourses(arm, way, ends, places))
    clearance, when = least_clearance(*timed)
    time = np.linspace(0.0, 5.0, 20_001)
    pieces = [np.searchsorted(one.ends_s, time).clip(max=len(one.ends_s) - 1) for one in timed]
    gaps = gaps_m(arms[0], timed[0].at(pieces[0], time), arms[1], timed[1].at(pieces[1], time)).min(axis=(0, 1))
    assert clearance <= gaps.min() + 1e-12
    assert clearance >= gaps.min() - RESOLUTION_M - 1e-6
    near = np.abs(time - when) < 0.02
    assert gaps[near].min() < gaps.min() + 0.02
