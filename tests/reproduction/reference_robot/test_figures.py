"""Figures of an energy model, on runs whose figures are known."""

import numpy as np
import pytest

from reproduction.reference_robot.check import energy_model_rows
from reproduction.reference_robot.figures import EXAMPLE_MOTION, TreeRuns, energy_model_figures, example_deviations
from reproduction.reference_robot.setup import fit_setup


def figures_of(duration, energy, speed_limit, tree=None, idle=None, change=None):
    motions = len(duration)
    tree = np.zeros(motions, dtype=int) if tree is None else tree
    idle = np.full(motions, 430.0) if idle is None else idle
    change = np.zeros((motions, 6)) if change is None else change
    runs = TreeRuns(np.array(speed_limit), np.array(duration), np.array(energy), idle, tree, change)
    return energy_model_figures(runs, np.arange(motions), 430.0)


def test_the_example_motion_itself_deviates_by_nothing():
    (fast, high), (best, low), (slow, much) = EXAMPLE_MOTION
    assert example_deviations(np.array([[slow, best, fast]]), np.array([[much, low, high]])) == pytest.approx(0.0)


def test_figures_of_a_profile_in_closed_form():
    """E = 90/d + 400 d: optimum at sqrt(90/400), a rising part that is nearly a line."""
    duration = np.array([[4.0, 3.0, 2.0, 1.5, 1.0, 0.7, np.sqrt(0.225), 0.3]])
    energy = 90.0 / duration + 400.0 * duration
    figures = figures_of(duration, energy, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0])
    optimum = 2.0 * np.sqrt(90.0 * 400.0)
    assert figures["mean_power_full_speed_w"] == pytest.approx(90.0 / 0.09 + 400.0)
    assert figures["rising_slope_over_idle"] == pytest.approx((energy[0, 0] - optimum) / (4.0 - np.sqrt(0.225)) / 430)
    assert figures["duration_ratio_slowest_to_fastest"] == pytest.approx(4.0 / 0.3)
    assert figures["duration_ratio_at_60_percent"] == pytest.approx(0.7 / 0.3)
    assert figures["optimum_inside_percent"] == 100.0
    assert figures["rising_linear_r2"] == pytest.approx(np.corrcoef(duration[0, :6], energy[0, :6])[0, 1] ** 2)
    assert figures["median_saving_j"] == pytest.approx(energy[0, -1] - optimum)
    assert figures["median_optimal_duration_s"] == pytest.approx(np.sqrt(0.225))
    assert figures["median_penalty_j"] == pytest.approx(energy[0, 0] - optimum)


def test_figures_of_trees_are_sums_over_their_motions():
    duration = np.array([[2.0, 1.0], [4.0, 2.0], [3.0, 2.0]])
    energy = np.array([[900.0, 1000.0], [1500.0, 2000.0], [2500.0, 4000.0]])
    figures = figures_of(duration, energy, [0.5, 1.0], np.array([7, 7, 9]), np.array([400.0, 430.0, 460.0]))
    assert [figures[f"{name}_tree_duration_s"] for name in ("min", "mean", "max")] == [2.0, 2.5, 3.0]
    assert figures["mean_tree_energy_j"] == 3500.0
    assert [figures[f"{name}_tree_power_full_speed_w"] for name in ("min", "max")] == [1000.0, 2000.0]
    assert figures["mean_power_full_speed_w"] == 1500.0
    assert (figures["idle_power_q05_w"], figures["idle_power_q95_w"]) == pytest.approx((403.0, 457.0))


def test_savings_go_with_the_travel_of_the_joints_as_the_rule_of_pearson_says():
    rng = np.random.default_rng(4)
    change, fastest = rng.uniform(0.0, 1.0, (40, 6)), rng.uniform(900.0, 1500.0, 40)
    energy = np.stack([np.full(40, 900.0), np.full(40, 800.0), fastest], axis=1)
    figures = figures_of(np.tile([3.0, 2.0, 1.0], (40, 1)), energy, [0.2, 0.5, 1.0], change=change)
    r = [np.corrcoef(column, fastest - 800.0)[0, 1] for column in (*change.T, change.sum(axis=1))]
    assert figures["saving_correlation_theta_sum"] == pytest.approx(r[6])
    assert figures["saving_correlation_least_main"] == pytest.approx(min(r[:3]))
    assert figures["saving_correlation_joint_2_lead"] == pytest.approx(r[1] - max(r[0], r[2]))
    assert figures["saving_correlation_most_wrist"] == pytest.approx(max(r[3:6]))


def test_joints_that_never_move_have_no_correlation():
    figures = figures_of([[3.0, 2.0, 1.0]], [[900.0, 700.0, 800.0]], [0.2, 0.5, 1.0])
    assert np.isnan(figures["saving_correlation_theta_sum"])


def test_an_optimum_at_full_speed_is_not_inside():
    figures = figures_of([[3.0, 2.0, 1.0]], [[900.0, 700.0, 500.0]], [0.2, 0.5, 1.0])
    assert figures["optimum_inside_percent"] == 0.0


def test_check_marks_what_is_held():
    metrics = {name: sum(item.bounds) / 2 for name, item in fit_setup().figures.items()}
    rows = energy_model_rows(metrics | {"idle_power_q95_w": 600.0})
    missed = [row["figure"] for row in rows if row["held"] == "false"]
    assert missed == ["idle power at the trees' points, 95 % quantile [W]"]
    assert [row["fitted"] for row in rows].count("false") == 1
