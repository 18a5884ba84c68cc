"""The correction of single motions: nothing where a model explains the runs, the runs where it does not."""

import numpy as np
import pytest

from robojoule.calibration.local_correction import LEAST_AMPLITUDE, amplitude_of, correction

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
