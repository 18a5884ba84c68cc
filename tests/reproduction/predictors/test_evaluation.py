from __future__ import annotations

import math

import numpy as np
import pytest

from reproduction.predictors.evaluation import beats_mean, error_rows, order_rows, outliers, passes_gate

TRUTH = np.array([[10.0, 1.0, 50.0], [30.0, 2.0, 70.0], [20.0, 3.0, 90.0]])


def test_errors_of_a_table_done_by_hand() -> None:
    measured = np.array([[10.0, 1.0, 100.0], [20.0, 2.0, 200.0], [0.0, 4.0, 400.0], [50.0, 5.0, 500.0]])
    off = np.array([[1.0, 0.1, 10.0], [-4.0, 0.2, -20.0], [3.0, -0.4, 40.0], [20.0, 0.5, 50.0]])
    rows = {(row.target, row.error): row for row in error_rows(measured + off, measured)}
    saving = rows["energy_saving_j", "abs"]
    assert (saving.p25, saving.p50, saving.p75, saving.max, saving.mean) == (2.5, 3.5, 8.0, 20.0, 7.0)
    assert (saving.motions, saving.zeros_left_out) == (4, 0)
    relative = rows["energy_saving_j", "rel_percent"]
    assert (relative.p50, relative.max, relative.mean) == pytest.approx((20.0, 40.0, 70 / 3))
    assert (relative.motions, relative.zeros_left_out) == (3, 1)
    for target in ("optimal_duration_s", "energy_penalty_j"):
        row = rows[target, "rel_percent"]
        assert (row.p25, row.p75, row.mean, row.zeros_left_out) == pytest.approx((10.0, 10.0, 10.0, 0))


def test_nothing_to_be_relative_to() -> None:
    rows = error_rows(np.ones((2, 3)), np.zeros((2, 3)))
    relative = [row for row in rows if row.error == "rel_percent"]
    assert all(math.isnan(row.p50) and row.motions == 0 and row.zeros_left_out == 2 for row in relative)


def test_order_within_trees() -> None:
    tree_ids = ["a"] * 4 + ["b"] * 4 + ["c"] * 4
    measured = np.array([1.0, 2, 3, 4, 1, 2, 3, 4, 7, 7, 7, 7])
    predicted = np.array([10.0, 20, 30, 40, 4, 3, 2, 1, 1, 2, 3, 4])
    spearman, kendall = order_rows(predicted, measured, tree_ids)
    for row in (spearman, kendall):
        assert row.trees == 2  # the third tree has no order
        assert (row.mean, row.min, row.p50) == pytest.approx((0.0, -1.0, 0.0))
    swapped = order_rows(np.array([1.0, 2, 4, 3]), np.array([1.0, 2, 3, 4]), ["a"] * 4)
    assert swapped[0].mean == pytest.approx(1 - 6 * 2 / (4 * 15))  # Spearman's formula
    assert swapped[1].mean == pytest.approx((5 - 1) / 6)  # five of six pairs in order


def test_order_does_not_depend_on_the_order_of_rows() -> None:
    random = np.random.default_rng(0)
    measured, predicted = random.normal(size=40), random.normal(size=40)
    trees = np.repeat(["a", "b", "c", "d"], 10)
    mixed = random.permutation(40)
    straight, shuffled = (order_rows(predicted[rows], measured[rows], trees[rows]) for rows in (np.arange(40), mixed))
    for first, second in zip(straight, shuffled, strict=True):
        assert (first.mean, first.min, first.p75) == pytest.approx((second.mean, second.min, second.p75))


def test_outliers_lie_beyond_tukeys_fences() -> None:
    measured = np.full(11, 100.0)
    residual = np.array([-3.0, -2, -1, -1, 0, 0, 0, 1, 1, 30, -40])
    marks = outliers(measured + residual, measured)
    assert marks.tolist() == [0] * 9 + [1, -1]
    assert not outliers(measured, measured).any()


def test_baseline_gate() -> None:
    training = np.array([[0.0, 0.0, 0.0], [2.0, 2.0, 2.0]])
    measured = np.array([[0.0, 0.0, 0.0], [2.0, 2.0, 2.0]])
    assert beats_mean(measured + 0.5, measured, training)
    assert not beats_mean(measured + np.array([0.5, 0.5, 1.0]), measured, training)


def test_better_than_the_mean_and_than_every_rival_passes():
    assert passes_gate(TRUTH + 0.1, TRUTH, TRUTH)
    assert passes_gate(TRUTH + 0.1, TRUTH, TRUTH, [TRUTH + 0.2])


def test_worse_than_the_mean_or_a_rival_in_one_target_fails():
    wrong = TRUTH + np.array([0.0, 5.0, 0.0])
    assert not passes_gate(wrong, TRUTH, TRUTH)
    assert not passes_gate(TRUTH + 0.1, TRUTH, TRUTH, [TRUTH + 0.2, TRUTH + np.array([9.0, 0.05, 9.0])])
    assert not passes_gate(np.full_like(TRUTH, np.nan), TRUTH, TRUTH)
