"""Corners of blended motions: within their zones, smooth, and where joints turn back in pieces."""

import numpy as np
import pytest

from robojoule.motion.corners import LARGEST_SHARE, Chain, Corners
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload
from tests.core_cases import kr16
from tests.motion.chains import ROBOTS, random_chains


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request):
    return load_robot(request.param, Payload(3.0))


@pytest.fixture(scope="module")
def chains(robot):
    return random_chains(robot)


@pytest.fixture(scope="module")
def corners(robot, chains):
    return Corners.of(robot, chains)


def test_the_path_leaves_the_legs_within_the_zones_only(corners, chains, robot):
    legs = (corners.end_rad - corners.start_rad) / corners.length_s[:, None]
    for corner, (leg, half) in enumerate(zip(corners.before, corners.half_s, strict=True)):
        chain, via = chains[corners.chain[leg]], corners.end_rad[leg]
        place = corner - int(np.searchsorted(corners.chain[corners.before], corners.chain[leg]))
        assert half <= min(chain.path_share[place], LARGEST_SHARE) * corners.length_s[leg : leg + 2].min() * (1 + 1e-9)
        pieces = np.flatnonzero(corners.corner == corner)
        curve = corners.pieces.positions_rad(pieces, np.linspace(0.0, 1.0, 90)).reshape(len(via), -1).T
        straight = np.linspace(0.0, half, 90)[:, None]
        every = np.concatenate([curve, via - straight * legs[leg], via + straight * legs[leg + 1]])
        away = np.linalg.norm(robot.tool_placements(every)[0] - robot.tool_placements(via)[0], axis=1)
        assert away.max() <= chain.radius_m[place] * (1.0 + 1e-3)
        assert curve[0] == pytest.approx(via - half * legs[leg], abs=1e-12)
        assert curve[-1] == pytest.approx(via + half * legs[leg + 1], abs=1e-12)


def test_slope_and_curvature_are_continuous(corners):
    ends = np.array([0.0, 1.0])
    legs = (corners.end_rad - corners.start_rad) / corners.length_s[:, None]
    for corner, (leg, half) in enumerate(zip(corners.before, corners.half_s, strict=True)):
        rows = np.flatnonzero(corners.corner == corner)
        length = (2.0 * half * corners.share[rows])[:, None, None]
        slopes = corners.pieces.slopes_rad(rows, ends) / length
        bends = corners.pieces.curvatures_rad(rows, ends) / length**2
        largest = np.abs(legs[leg + 1] - legs[leg]).max() / half
        assert np.concatenate([slopes[:, :, 0], legs[None, leg + 1]]) == pytest.approx(
            np.concatenate([legs[None, leg], slopes[:, :, 1]]), abs=1e-9
        )
        still = np.zeros((1, legs.shape[1]))
        assert np.concatenate([bends[:, :, 0], still]) == pytest.approx(
            np.concatenate([still, bends[:, :, 1]]), abs=1e-9 * largest
        )


def test_the_path_of_a_chain_is_looked_at_all_along(corners, chains):
    for motion, chain in enumerate(chains):
        points = corners.points_rad(motion, 0.02)
        assert np.abs(np.diff(points, axis=0)).max() <= 0.02 * (1.0 + 1e-9)
        assert points[[0, -1]] == pytest.approx(chain.points_rad[[0, -1]], abs=1e-9)


def test_corners_of_a_share_take_it_of_the_shorter_leg():
    robot = kr16()
    points = robot.home_rad + np.array([[0.0] * 6, [0.2] + [0.0] * 5, [0.2, 0.4] + [0.0] * 4])
    corners = Corners.of(robot, [Chain(points, np.array([np.inf]), np.array([0.25]))])
    assert corners.half_s == pytest.approx(0.25 * corners.length_s.min())


def test_no_joint_turns_back_on_a_piece(corners):
    s = np.linspace(0.0, 1.0, 40)
    slopes = corners.pieces.slopes_rad(slice(None), s) * np.sign(corners.pieces.delta_rad)[:, :, None]
    assert slopes.min() >= -1e-9 * np.abs(slopes).max()
    assert np.bincount(corners.corner, corners.share) == pytest.approx(1.0)
    assert len(corners.corner) > len(corners.half_s)  # else nothing was tested


def test_doubled_points_are_one_with_the_narrower_zone():
    points = np.array([[0, 0], [0, 0], [1, 0], [1, 0], [1, 1], [1, 1]], dtype=float)
    chain, legs = Chain(points, np.array([1.0, 2.0, 3.0, 4.0]), np.full(4, 0.5)).distinct()
    assert chain.points_rad.tolist() == [[0, 0], [1, 0], [1, 1]]
    assert chain.radius_m.tolist() == [2.0]
    assert legs.tolist() == [1, 3]
