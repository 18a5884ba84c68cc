"""The electrical model in cases that can be worked out by hand."""

import dataclasses

import numpy as np
import pytest

from robojoule.robots.drives import idle_power_w, mains_power_w
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
