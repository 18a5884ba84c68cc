"""The electrical model in cases that can be worked out by hand."""

import dataclasses

import numpy as np
import pytest

from robojoule.robots.drives import (
    bus_gradient,
    drive_powers,
    idle_power_w,
    mains_energy_j,
    mains_gradient,
    mains_power_w,
    mains_weight,
)
from tests.core_cases import kr16


@pytest.fixture
def drives():
    return kr16().drives


def test_idle_without_gravity_is_base_power(drives):
    assert idle_power_w(drives, np.zeros((3, 6))) == pytest.approx(drives.base_power_w)


def test_idle_adds_copper_loss_of_the_motors(drives):
    gravity = np.array([0.0, 700.0, -300.0, 0.0, 20.0, 0.0])
    motor = gravity / drives.gear_ratio
    expected = drives.base_power_w + (drives.copper_w_per_nm2 * motor**2).sum() / drives.inverter_efficiency
    assert float(idle_power_w(drives, gravity)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("bus, regeneration, extra", [(890.0, 0.0, 1000.0), (-500.0, 0.0, 0.0), (-500.0, 0.4, -200.0)])
def test_mains_power_in_both_regimes(drives, bus, regeneration, extra):
    drives = dataclasses.replace(drives, inverter_efficiency=0.89, regeneration_efficiency=regeneration)
    expected = drives.base_power_w + drives.drive_active_power_w + extra
    assert float(mains_power_w(drives, np.array(bus))) == pytest.approx(expected)


def test_reflected_inertia(drives):
    assert drives.reflected_inertia_kg_m2 == pytest.approx(drives.gear_ratio**2 * drives.rotor_inertia_kg_m2)


def states(rows=40):
    """Directions, velocities and transmitted torques of random states, each of shape (rows, 6)."""
    rng = np.random.default_rng(6)
    velocity = rng.normal(0.0, 1.0, (rows, 6))
    return np.sign(velocity), velocity, rng.normal(0.0, 200.0, (rows, 6))


def test_powers_follow_from_the_equations_joint_by_joint(drives):
    drives = dataclasses.replace(drives, load_friction=np.full(6, 0.03))
    direction, velocity, load = states(5)
    kept = load.copy()
    found = drive_powers(drives, direction, velocity, load)
    np.testing.assert_array_equal(load, kept)
    for row in range(5):
        bus = friction_w = copper_w = 0.0
        for j in range(6):
            friction = direction[row, j] * (drives.coulomb_nm[j] + 0.03 * abs(load[row, j]))
            friction += drives.viscous_nm_s_per_rad[j] * velocity[row, j]
            torque = load[row, j] + friction
            copper = drives.copper_w_per_nm2[j] * (torque / drives.gear_ratio[j]) ** 2
            friction_w, copper_w = friction_w + friction * velocity[row, j], copper_w + copper
            bus += torque * velocity[row, j] + copper
            assert found.torque_nm[row, j] == pytest.approx(torque, rel=1e-12)
        assert found.friction_w[row] == pytest.approx(friction_w, rel=1e-9)
        assert found.copper_w[row] == pytest.approx(copper_w, rel=1e-9)
        assert found.bus_w[row] == pytest.approx(bus, rel=1e-9)


def test_resting_drives_draw_idle_power(drives):
    gravity = np.array([[0.0, 700.0, -300.0, 0.0, 20.0, 0.0]])
    still = np.zeros_like(gravity)
    bus = drive_powers(drives, still, still, gravity).bus_w
    assert mains_power_w(drives, bus, active=0.0) == pytest.approx(idle_power_w(drives, gravity), rel=1e-12)


def test_derivatives_of_mains_power_agree_with_finite_differences(drives):
    drives = dataclasses.replace(
        drives, load_friction=np.full(6, 0.03), regeneration_efficiency=0.3, drive_active_power_w=30.0
    )
    direction, velocity, load = states()
    powers = drive_powers(drives, direction, velocity, load)
    bus, moving = powers.bus_w, np.linspace(0.0, 1.0, 40)
    assert (bus > 0.0).any() and (bus < 0.0).any()

    def power(changed, torque=load):
        return mains_power_w(changed, drive_powers(changed, direction, velocity, torque).bus_w, moving)

    weight = mains_weight(drives, 1.0, (bus > 0.0).astype(float))[:, None]
    found, after_load = bus_gradient(drives, direction, velocity, load, powers.torque_nm, weight)
    found |= mains_gradient(drives, np.ones(40), np.maximum(bus, 0.0), bus, moving)
    for name, gradient in found.items():
        value = np.asarray(getattr(drives, name))
        for joint in range(6) if value.ndim else [...]:
            step = 1e-6 * np.maximum(np.abs(value[joint]), 1e-3)
            above, below = (value.copy() for _ in range(2))
            above[joint] += step
            below[joint] -= step
            plus, minus = (power(dataclasses.replace(drives, **{name: x})) for x in (above, below))
            exact = gradient[:, joint] if value.ndim else gradient
            np.testing.assert_allclose(exact, (plus - minus) / (2.0 * step), rtol=1e-5, atol=1e-5)
    for joint in range(6):
        step = np.zeros(6)
        step[joint] = 1e-4
        numeric = (power(drives, load + step) - power(drives, load - step)) / 2e-4
        np.testing.assert_allclose(after_load[:, joint], numeric, rtol=1e-5, atol=1e-5)


def test_energy_is_the_integral_of_power_whatever_the_regime_of_the_bus(drives):
    drives = dataclasses.replace(drives, regeneration_efficiency=0.3, drive_active_power_w=30.0)
    bus = 900.0 * np.cos(np.linspace(0.0, 7.0, 100_001))
    steps = np.full(bus.size, 7.0 / 100_000)
    steps[[0, -1]] /= 2.0
    energy = mains_energy_j(drives, 7.0, steps @ np.maximum(bus, 0.0), steps @ bus)
    assert energy == pytest.approx(steps @ mains_power_w(drives, bus), rel=1e-12)
