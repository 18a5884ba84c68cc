"""The recursion along paths against Pinocchio's inverse dynamics, state by state."""

import numpy as np
import pinocchio as pin
import pytest

from robojoule.motion.recursion import path_points
from robojoule.robots import list_robots, load_robot
from robojoule.robots.robot import Payload


def expected(model: pin.Model, q: np.ndarray, along: np.ndarray) -> np.ndarray:
    """m, c and g by three calls a state, shape (3, n, N)."""
    data, zero = model.createData(), np.zeros(model.nv)
    columns = []
    for state, change in zip(q.T, along.T, strict=True):
        gravity = pin.rnea(model, data, state, zero, zero).copy()
        inertia = pin.rnea(model, data, state, zero, change) - gravity
        columns.append([inertia, pin.rnea(model, data, state, change, zero) - gravity, gravity])
    return np.array(columns).transpose(1, 2, 0)


def check(model: pin.Model, states: int) -> None:
    q, along = np.random.default_rng(3).uniform(-3.0, 3.0, (2, model.nv, states))
    found, reference = path_points(model, q, along), expected(model, q, along)
    for part, exact in ((found[:2], reference[:2]), (found[2], reference[2])):  # c of a single joint is zero
        assert np.abs(part - exact).max() <= 1e-13 * np.abs(exact).max()


@pytest.mark.parametrize("name", list_robots())
def test_every_robot_of_the_catalog(name):
    check(load_robot(name, Payload(3.0, (0.02, -0.05, 0.1))).model, 12)


@pytest.mark.parametrize("parents", [[0], [0, 1, 2, 2, 4]], ids=["one joint", "branches"])
def test_any_axes_placements_and_inertias(parents):
    rng = np.random.default_rng(7)
    model = pin.Model()
    for joint, parent in enumerate(parents):
        axis = rng.normal(size=3)
        index = model.addJoint(
            parent, pin.JointModelRevoluteUnaligned(axis / np.linalg.norm(axis)), pin.SE3.Random(), str(joint)
        )
        if joint != 1:  # one link without mass
            model.appendBodyToJoint(index, pin.Inertia.Random(), pin.SE3.Random())
    model.gravity.linear = rng.normal(size=3) * 9.81
    check(model, 20)


def test_a_point_does_not_depend_on_the_points_beside_it():
    model = load_robot("ur_ur10e").model
    q, along = np.random.default_rng(4).uniform(-3.0, 3.0, (2, 6, 4100))
    whole = path_points(model, q, along)
    for part in (slice(0, 1), slice(3, 20), slice(1500, 4100)):
        assert np.array_equal(path_points(model, q[:, part], along[:, part]), whole[:, :, part])
    assert path_points(model, q[:, :0], along[:, :0]).shape == (3, 6, 0)
