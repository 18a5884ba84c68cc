"""Figures of an energy model, on runs whose figures are known."""

import numpy as np
import pytest

from reproduction.reference_robot.check import PUBLISHED_FIGURES, energy_model_rows
from reproduction.reference_robot.figures import EXAMPLE_MOTION, energy_model_figures, example_deviations


def test_the_example_motion_itself_deviates_by_nothing():
    (fast, high), (best, low), (slow, much) = EXAMPLE_MOTION
    assert example_deviations(np.array([[slow, best, fast]]), np.array([[much, low, high]])) == pytest.approx(0.0)


def test_figures_of_a_profile_in_closed_form():
    """E = 90/d + 400 d: optimum at sqrt(90/400), a rising part that is nearly a line."""
    duration = np.array([[4.0, 3.0, 2.0, 1.5, 1.0, 0.7, np.sqrt(0.225), 0.3]])
    energy = 90.0 / duration + 400.0 * duration
    figures = energy_model_figures(duration, energy, np.array([0]))
    optimum = 2.0 * np.sqrt(90.0 * 400.0)
    assert figures["mean_power_full_speed_w"] == pytest.approx(90.0 / 0.09 + 400.0)
    assert figures["rising_chord_w"] == pytest.approx((energy[0, 0] - optimum) / (4.0 - np.sqrt(0.225)))
    assert figures["duration_ratio_slowest_to_fastest"] == pytest.approx(4.0 / 0.3)
    assert figures["optimum_inside_percent"] == 100.0
    assert figures["rising_linear_r2"] == pytest.approx(np.corrcoef(duration[0, :6], energy[0, :6])[0, 1] ** 2)


def test_an_optimum_at_full_speed_is_not_inside():
    duration, energy = np.array([[3.0, 2.0, 1.0]]), np.array([[900.0, 700.0, 500.0]])
    assert energy_model_figures(duration, energy, np.array([0]))["optimum_inside_percent"] == 0.0


def test_check_marks_what_is_held():
    metrics = {item.metric: (item.low + item.high) / 2 for item in PUBLISHED_FIGURES} | {"idle_power_max_w": 600.0}
    rows = energy_model_rows(metrics)
    assert [row["held"] for row in rows] == ["true"] * (len(rows) - 1) + ["false"]
    assert rows[-1]["figure"] == "largest idle power at the trees' points [W]" and rows[-1]["robojoule"] == 600.0
