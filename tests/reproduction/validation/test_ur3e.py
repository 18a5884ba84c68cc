"""The UR3e: what the catalog and an identification say of its measured power."""

import numpy as np
import pytest

from reproduction.validation.ur3e import (
    halves,
    identified_on_one_half,
    load_recording,
    recorded_robot,
    with_catalog,
)


@pytest.fixture(scope="module")
def catalog():
    return with_catalog()


def test_the_recording_is_whole():
    """Against figures that the source's table gives by itself: duration, samples, mean power, its extremes."""
    log = load_recording(recorded_robot())
    assert (len(log.time_s), log.time_s[-1]) == (888, pytest.approx(35.48))
    assert log.power_w.mean() == pytest.approx(42.0, abs=0.1)
    np.testing.assert_allclose(np.diff(log.time_s), 0.04, atol=1e-9)
    travelled = np.trapezoid(np.asarray(log.velocity_rad_s), log.time_s, axis=0)
    np.testing.assert_allclose(travelled, log.position_rad[-1] - log.position_rad[0], atol=0.01)


def test_power_above_standing_with_nothing_fitted(catalog):
    """Targets: 5 % and 2 W. Both are missed (docs/validation-ur3e.md), by no more than this."""
    assert catalog.rmse_above_rest_w < 2.1
    assert abs(catalog.above_rest_error_percent) < 9.0
    assert abs(catalog.energy_error_percent) < 1.0


def test_standing_power_is_within_what_three_arms_draw(catalog):
    measured, modelled = catalog.rest_w
    assert 26.0 < modelled < 40.0
    assert measured == pytest.approx(37.4, abs=0.5)


@pytest.mark.parametrize("first", [True, False], ids=["first", "second"])
def test_identified_on_one_half_each_motion_of_the_other_is_within_some_5_percent(first):
    found, other = identified_on_one_half(first)
    assert np.abs(other.motion_errors_percent).max() < 5.2
    assert other.rmse_w < 2.1
    assert found.power_side == "arm"
    known = {parameter.name: parameter for parameter in found.parameters}
    assert known["base_power_w"].value == pytest.approx(37.0, abs=2.0)
    assert 0.5 < known["drive_active_power_w"].value < 3.0


def test_the_halves_share_one_instant_of_rest():
    log = load_recording(recorded_robot())
    first, second = halves(log)
    assert first.time_s[-1] == second.time_s[0]
    assert len(first.time_s) + len(second.time_s) == len(log.time_s) + 1
    assert np.abs(np.asarray(first.velocity_rad_s)[-1]).max() < 0.002
