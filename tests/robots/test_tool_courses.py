"""Lines and circles of a tool: against closed forms, and SciPy's interpolation of rotations."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from robojoule.errors import InputError
from robojoule.robots.rigid_body import Placement
from robojoule.robots.tool_courses import ToolCourse, rotations_by

S = np.linspace(0.0, 1.0, 41)
START = Placement.of((0.4, -0.2, 0.7), (0.3, -0.2, 1.1))


@pytest.mark.parametrize(
    "turn", [(0.0, 0.0, 0.0), (0.5, -0.4, 0.9), (2.0, 1.0, -1.5), (math.pi, 0.0, 0.0), (1e-7, 0, 0)]
)
def test_a_line_is_even_in_position_and_turn(turn):
    end = Placement(Rotation.from_rotvec(turn).as_matrix() @ START.rotation, np.array([0.1, 0.5, 0.2]))
    course = ToolCourse.between(START, end)
    rotations, places = course.at(S)
    np.testing.assert_allclose(places, START.origin_m + S[:, None] * (end.origin_m - START.origin_m), atol=1e-15)
    assert course.length_m == pytest.approx(math.dist(START.origin_m, end.origin_m), rel=1e-15)
    np.testing.assert_allclose(rotations[-1], end.rotation, atol=1e-14)
    if turn[0] != math.pi:  # by half a turn there are two shortest ways
        assert course.turned_rad == pytest.approx(Rotation.from_rotvec(turn).magnitude(), abs=1e-14)
        between = Slerp([0.0, 1.0], Rotation.from_matrix([START.rotation, end.rotation]))(S)
        np.testing.assert_allclose(rotations, between.as_matrix(), atol=1e-13)


@pytest.mark.parametrize("angle_deg", [10.0, 90.0, 179.0, 181.0, 300.0])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.8])
def test_a_circle_passes_its_point_at_constant_speed(angle_deg, share):
    radius, center = 0.3, np.array([0.2, 0.1, 0.5])
    frame = Rotation.from_rotvec([0.4, -1.0, 0.3]).as_matrix()

    def on_it(angle: float) -> np.ndarray:
        return center + frame @ np.array([radius * math.cos(angle), radius * math.sin(angle), 0.0])

    angle = math.radians(angle_deg)
    start, end = Placement(np.eye(3), on_it(0.0)), Placement(np.eye(3), on_it(angle))
    course = ToolCourse.between(start, end, on_it(share * angle))
    assert course.length_m == pytest.approx(radius * angle, rel=1e-9)
    np.testing.assert_allclose(course.at(S)[1], [on_it(s * angle) for s in S], atol=1e-9)


def test_three_points_on_a_line_are_a_line_if_the_second_is_between():
    start, end = Placement(np.eye(3), np.zeros(3)), Placement(np.eye(3), np.array([0.2, 0.0, 0.0]))
    assert ToolCourse.between(start, end, [0.1, 0.0, 0.0]).length_m == pytest.approx(0.2)
    for beyond in ([0.3, 0.0, 0.0], [-0.1, 0.0, 0.0]):
        with pytest.raises(InputError, match="the three points of the circle are on a line"):
            ToolCourse.between(start, end, beyond)


def test_a_circle_to_where_it_starts_is_refused():
    with pytest.raises(InputError, match="the circle ends where it starts"):
        ToolCourse.between(START, START, START.origin_m + np.array([0.1, 0.0, 0.0]))
    assert ToolCourse.between(START, START, START.origin_m).length_m == 0.0


def test_rotations_are_those_of_scipy():
    vectors = np.random.default_rng(4).normal(0.0, 2.0, (50, 3))
    vectors[:3] = 0.0, 1e-9, 1e-4
    np.testing.assert_allclose(rotations_by(vectors), Rotation.from_rotvec(vectors).as_matrix(), atol=1e-14)
