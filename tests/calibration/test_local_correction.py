"""The correction of single motions: nothing where a model explains the runs, the runs where it does not."""

import numpy as np
import pytest

from robojoule.calibration.local_correction import (
    LEAST_AMPLITUDE,
    amplitude_of,
    correction,
    lasting_amplitude,
    open_deviation,
)

GRID = np.array([0.2, 0.5, 1.0])


def test_noise_alone_gives_no_amplitude():
    rng = np.random.default_rng(0)
    assert amplitude_of(0.01 * rng.standard_normal(4000), np.full(4000, 0.0105)) == LEAST_AMPLITUDE
    assert amplitude_of(0.03 * rng.standard_normal(4000), np.full(4000, 0.01)) == pytest.approx(0.0283, rel=0.05)


def test_runs_that_are_sure_are_met_and_their_error_fades():
    mean, deviation = correction(
        np.array([0]), np.array([0.5]), np.array([0.04]), np.array([1e-6]), GRID, motions=2, amplitude=0.02
    )
    assert mean[0] == pytest.approx(0.04 * np.exp(-np.abs(np.log(GRID / 0.5)) / 1.5), rel=1e-6)
    assert deviation[0, 1] < 1e-5
    assert (deviation[0, [0, 2]] > 0.01).all()
    assert (mean[1] == 0.0).all()
    assert deviation[1] == pytest.approx(0.02)


def test_what_stamps_explain_does_not_last():
    rng = np.random.default_rng(1)
    stamps = np.full(4000, 0.002)
    assert lasting_amplitude(0.002 * rng.standard_normal(4000), stamps, 1.0, most=0.01) < 5e-4
    assert lasting_amplitude(np.hypot(0.002, 0.006) * rng.standard_normal(4000), stamps, 1.0, most=0.01) == (
        pytest.approx(0.006, rel=0.05)
    )
    assert lasting_amplitude(0.05 * rng.standard_normal(4000), stamps, 1.0, most=0.01) == 0.01


def test_few_residuals_are_no_proof():
    stamps = np.full(10, 0.002)
    assert lasting_amplitude(1.0 * stamps, stamps, 0.5, most=0.01) == 0.0  # half of the freedom was the fit's
    assert lasting_amplitude(2.0 * stamps, stamps, 0.5, most=0.01) > 0.0


def test_speed_limits_that_were_run_are_surer_than_others():
    once, stamps, shape = (np.array([0]), np.array([1])), np.array([0.003]), (2, 3)
    deviation = open_deviation(once, stamps, 0.004, shape)
    assert deviation[0, 1] == pytest.approx(0.004 * 0.6)  # 0.003 over the root of both squares
    assert deviation[0, 0] == deviation[1, 1] == pytest.approx(0.004)
    twice = np.array([0, 0]), np.array([1, 1])
    assert open_deviation(twice, np.array([0.003, 0.003]), 0.004, shape)[0, 1] < deviation[0, 1]
    assert open_deviation(once, np.array([0.0]), 0.004, shape)[0, 1] < 1e-5
    assert (open_deviation(once, stamps, 0.0, shape) == 0.0).all()
