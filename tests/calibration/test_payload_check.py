"""A payload that does not fit the log is told, one that fits is not."""

import pytest

import robojoule as rj
from tests.calibration.plant import ROBOT, Plant, make_log
from tests.calibration.test_lag import log_of


@pytest.mark.parametrize("seed", [21, 22])
def test_a_wrong_payload_is_told_with_the_one_that_fits(seed):
    log = log_of(make_log(Plant(seed), seed, motions=30)[0])  # carries 10 kg
    for given in (6.0, 14.0):
        found = rj.identify(log, rj.load_robot(ROBOT, payload_kg=given))
        assert found.payload_that_fits_kg == pytest.approx(10.0, abs=1.0)
        assert any("looks like a payload of about" in warning for warning in found.warnings)
    assert rj.identify(log, rj.load_robot(ROBOT, payload_kg=10.0)).payload_that_fits_kg is None


@pytest.mark.parametrize("motions", [2, 4, 6])
def test_a_few_motions_tell_no_payload(motions):
    for seed in (21, 23):
        log = log_of(make_log(Plant(seed), seed, motions=motions)[0])
        assert rj.identify(log, rj.load_robot(ROBOT, payload_kg=10.0)).payload_that_fits_kg is None
