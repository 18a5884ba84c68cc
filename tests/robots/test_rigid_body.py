"""Sums and turns of rigid bodies against point masses, matrices and Pinocchio."""

import numpy as np
import pytest

from robojoule.robots.rigid_body import Placement, RigidBody, quaternions
from tests.robots.arms import random_body, random_placement


def turns(rpy):
    """Rotation matrix as a product of three matrices."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def test_placements_are_matrices():
    rng = np.random.default_rng(0)
    for _ in range(20):
        rpy = tuple(rng.uniform(-3.1, 3.1, 3))
        first, second = Placement.of([0.1, -0.2, 0.3], rpy), random_placement(rng)
        assert first.rotation == pytest.approx(turns(rpy), abs=1e-14)
        both, point = first @ second, rng.normal(size=3)
        assert both.rotation == pytest.approx(first.rotation @ second.rotation, abs=1e-14)
        assert both.at(point) == pytest.approx(first.at(second.at(point)), abs=1e-14)
    assert Placement.identity().at([1.0, 2.0, 3.0]).tolist() == [1.0, 2.0, 3.0]


def test_bodies_add_up_as_point_masses_do():
    """Mass, first moments and inertia about the origin are sums over the points, in whatever frame they were added."""
    rng = np.random.default_rng(1)
    masses, points = rng.uniform(0.1, 3.0, 6), rng.uniform(-1.0, 1.0, (6, 3))
    at = random_placement(rng)
    inside = [
        RigidBody(m, at.rotation.T @ (p - at.origin_m), np.zeros((3, 3))) for m, p in zip(masses, points, strict=True)
    ]
    one = RigidBody.nothing()
    for body in inside[:4]:
        one += body
    whole = one.placed(at) + (inside[4] + inside[5]).placed(at)
    inertia = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True))
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia
    assert whole.parameters == pytest.approx([masses.sum(), *masses @ points, xx, xy, yy, xz, yz, zz], abs=1e-13)
    assert whole.center_m == pytest.approx(masses @ points / masses.sum())


def test_parameters_make_the_body_again():
    body = random_body(np.random.default_rng(2))
    again = RigidBody.of_parameters(body.parameters)
    assert again.mass_kg == body.mass_kg
    assert again.center_m == pytest.approx(body.center_m, abs=1e-15)
    assert again.inertia_kg_m2 == pytest.approx(body.inertia_kg_m2, abs=1e-14)
    nothing = RigidBody.of_parameters(RigidBody.nothing().parameters)
    assert nothing.mass_kg == 0.0 and not nothing.center_m.any() and not nothing.inertia_kg_m2.any()


def test_a_heavier_body_has_the_same_shape():
    body = random_body(np.random.default_rng(3))
    heavier = body.heavier(0.2)
    assert heavier.parameters == pytest.approx(1.2 * body.parameters, rel=1e-14)
    assert np.array_equal(heavier.center_m, body.center_m)


HALF_TURNS = {"x": (np.pi, 0.0, 0.0), "y": (0.0, np.pi, 0.0), "z": (0.0, 0.0, np.pi), "none": (0.0, 0.0, 0.0)}


@pytest.mark.parametrize("rpy", HALF_TURNS.values(), ids=HALF_TURNS.keys())
def test_quaternions_near_half_turns(rpy):
    near = np.array(rpy) + np.random.default_rng(4).uniform(-1e-3, 1e-3, (40, 3))
    rotations = np.stack([turns(angles) for angles in near], axis=-1)
    w, *vector = quaternions(rotations).T
    assert (w >= 0.0).all()
    assert w**2 + np.sum(np.square(vector), axis=0) == pytest.approx(1.0, abs=1e-14)
    v = np.array(vector)
    cross = np.einsum(
        "ijk,kn->ijn",
        np.array(
            [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]]
        ),
        v,
    )
    again = (2 * w**2 - 1) * np.eye(3)[..., None] + 2 * np.einsum("in,jn->ijn", v, v) + 2 * w * cross
    assert again == pytest.approx(rotations, abs=1e-14)


def test_every_step_equals_pinocchios_to_the_bit():
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(5)
    for _ in range(200):
        rpy = tuple(rng.uniform(-3.2, 3.2, 3))
        first, second, a, b = (
            Placement.of(rng.normal(size=3), rpy),
            random_placement(rng),
            random_body(rng),
            random_body(rng),
        )
        pins = [pin.SE3(x.rotation, x.origin_m) for x in (first, second)]
        bodies = [pin.Inertia(x.mass_kg, x.center_m, x.inertia_kg_m2) for x in (a, b)]
        assert np.array_equal(first.rotation, pin.rpy.rpyToMatrix(*rpy))
        both, product = first @ second, pins[0] * pins[1]
        assert np.array_equal(both.rotation, product.rotation) and np.array_equal(both.origin_m, product.translation)
        moved = pins[0].act(bodies[0])
        total = moved + bodies[1]
        moved += bodies[1]
        own = a.placed(first) + b
        assert total.mass == own.mass_kg
        assert np.array_equal(own.center_m, moved.lever) and np.array_equal(own.inertia_kg_m2, moved.inertia)
        assert np.array_equal(own.parameters, moved.toDynamicParameters())
        assert np.array_equal(quaternions(first.rotation[..., None])[0], _upper(pin.Quaternion(first.rotation)))


def _upper(quaternion):
    x, y, z, w = quaternion.coeffs()
    return np.array([w, x, y, z]) * (1.0 if w >= 0 else -1.0)
