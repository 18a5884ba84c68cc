"""Joints that follow a tool on its way: the tool is on it by another library's kinematics, what cannot be is told."""

import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from robojoule.errors import InputError
from robojoule.robots import load_robot
from robojoule.robots.rigid_body import Placement
from robojoule.robots.tool_following import Followed, follow
from tests.motion.tool_moves import ROBOTS, random_moves

KR16 = load_robot("kuka_kr16_r2010_2")


def positions(followed: Followed, per_piece: int = 25) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the way (N,) and joint positions there (N, n)."""
    x = np.linspace(-1.0, 1.0, per_piece)
    s = np.concatenate([a + (b - a) * (x + 1.0) / 2.0 for a, b in pairwise(followed.breaks)])
    return s, np.concatenate([chebyshev.chebval(x, part.T).T for part in followed.coefficients_rad])


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("is_circle", [False, True], ids=["line", "circle"])
def test_the_tool_is_on_its_way_by_pinocchio(name, is_circle):
    pin = pytest.importorskip("pinocchio")
    robot = load_robot(name)
    model = robot.model
    data = model.createData()
    for move in random_moves(robot, 6, seed=3, circles=is_circle):
        followed = move.followed(robot)
        s, q = positions(followed)
        rotations, places = followed.course.at(s)
        for row, rotation, place in zip(q, rotations, places, strict=True):
            pin.framesForwardKinematics(model, data, row)
            body = data.oMi[robot.mechanism.tool_body]
            flange = Placement(body.rotation, body.translation) @ robot.mechanism.tool
            np.testing.assert_allclose(flange.at(np.array(move.tool_m)), place, atol=1e-8)
            np.testing.assert_allclose(flange.rotation, rotation, atol=1e-8)
        np.testing.assert_allclose(q[0], move.start_rad, atol=1e-9)
        np.testing.assert_allclose(q[-1], move.end_rad, atol=1e-6)


@pytest.mark.parametrize("name", ROBOTS)
def test_no_joint_jumps_or_turns_back_within_a_piece(name):
    robot = load_robot(name)
    turned_back = 0
    for move in random_moves(robot, 6, seed=8):
        followed = move.followed(robot)
        _, q = positions(followed, 101)
        steps = np.diff(q.reshape(len(followed.breaks) - 1, 101, -1), axis=1)
        assert np.abs(steps).max() < 0.05
        for piece in steps:
            assert (np.minimum(piece.max(axis=0), -piece.min(axis=0)) <= 1e-9).all()
        turned_back += len(followed.breaks) - 2
        dense = followed.points_rad(0.01)
        assert np.abs(np.diff(dense, axis=0)).max() <= 0.0101
    assert turned_back > 0


def test_a_motion_that_goes_nowhere_has_one_piece():
    q = np.radians([0.0, -70.0, 90.0, 10.0, 40.0, 0.0])
    followed = follow(KR16, q, q, (0.0, 0.0, 0.1))
    assert len(followed.breaks) == 2
    np.testing.assert_array_equal(followed.coefficients_rad[0, :, 0], q)
    assert not followed.coefficients_rad[0, :, 1:].any()


def test_lines_through_a_singular_wrist_are_refused():
    # Joint 5 goes from 20 to -20 deg in the same branch: by the other one joints 4 and 6 would turn by half a turn.
    start, end = np.radians([[0.0, -80.0, 90.0, 0.0, 20.0, 0.0], [0.0, -80.0, 90.0, 180.0, 20.0, -180.0]])
    with pytest.raises(InputError, match=r"joint_\d at -?\d+\.\d deg, the end has it at|singularity"):
        follow(KR16, start, end, (0.1, 0.0, 0.2))


def test_lines_out_of_reach_are_refused():
    """Both ends are within reach, the line between them passes the column of the arm."""
    start = np.radians([80.0, -60.0, 100.0, 0.0, 50.0, 0.0])
    end = np.radians([-100.0, -60.0, 100.0, 0.0, 50.0, 0.0])
    with pytest.raises(
        InputError, match=r"singularity or the end of its reach at \d+ %|beyond its limit|the end has it"
    ):
        follow(KR16, start, end, (0.0, 0.0, 0.0))


def test_turns_beyond_a_joint_limit_are_refused():
    """The flange turns about its own axis from one side of the range to the other, by the shorter way."""
    start, end = np.radians([[0.0, -70.0, 90.0, 0.0, 50.0, angle] for angle in (-340.0, -100.0)])
    assert KR16.lower_rad[5] == pytest.approx(math.radians(-350.0))
    with pytest.raises(InputError, match=r"joint_6 gets beyond its limit at|the end has it"):
        follow(KR16, start, end, (0.0, 0.0, 0.0))
    end[5] = start[5] - math.radians(30.0)
    with pytest.raises(InputError, match=r"joint_6 gets beyond its limit at \d+ % of the way"):
        follow(KR16, start, end, (0.0, 0.0, 0.0))
