"""The thesis's predictor: three-segment profiles, the idle power that they imply, plans that wait rather than crawl."""

import numpy as np
import pytest

from reproduction.methods.predicted_three_segment import PredictedThreeSegment, three_segment_costs
from reproduction.methods.three_segment_profile import ThreeSegmentShape, three_segments
from robojoule.errors import InputError
from robojoule.planning.batch import TreeBatch
from tests.core_cases import kr16
from tests.planning.trees import tree


def test_idle_power_is_the_rising_slope_or_that_of_the_vertex_before():
    d_min, d_max = np.array([0.5, 0.0, 0.5]), np.array([2.5, 0.0, 2.5])
    costs = three_segment_costs(
        d_min, [1.0, 0.0, 1.0], d_max, [100.0, 0.0, 100.0], [720.0, 0.0, 576.0], ThreeSegmentShape()
    )
    assert [cost.idle_post_w for cost in costs] == pytest.approx([500.0, 500.0, 400.0])
    assert [cost.idle_prior_w for cost in costs] == pytest.approx([500.0, 500.0, 400.0])
    with pytest.raises(InputError, match="idle power"):
        three_segment_costs([0.0], [0.0], [0.0], [0.0], [0.0], ThreeSegmentShape())


def test_what_is_left_of_a_long_cycle_is_waited():
    batch = TreeBatch(kr16(), [tree()])
    parameters = np.stack([np.full(4, 100.0), 1.3 * batch.d_min_s, np.full(4, 900.0)], axis=1)
    times = batch.least_cycles_s[:, None] * np.array([3.0])
    found = PredictedThreeSegment(parameters, ThreeSegmentShape()).plan(batch, times)
    plan, costs = found.plans[0][0], found.costs[0]
    assert plan.prior_waits_s.sum() + plan.post_waits_s.sum() > 0.0
    for cost, duration in zip(costs, plan.durations_s, strict=True):
        assert duration <= cost.profile.durations_s[-2] + 1e-6  # the rising line is never used


class TestThreeSegments:
    def test_lines_run_through_the_corners(self):
        profile, idle = three_segments(0.6, 1.0, 3.5, saving_j=200.0, penalty_j=960.0)
        assert profile.durations_s == pytest.approx([0.6, 1.0 - 0.4 * 0.4, 1.0 + 0.04 * 2.5, 3.5])
        assert profile.energies_j == pytest.approx([250.0, 50.0, 50.0, 1010.0])
        assert idle == pytest.approx(960.0 / 2.4) == profile.slopes_w[-1]

    def test_the_offset_moves_the_profile_and_not_its_slopes(self):
        low, _ = three_segments(0.6, 1.0, 3.5, 200.0, 960.0, ThreeSegmentShape(offset_j=1.0))
        high, _ = three_segments(0.6, 1.0, 3.5, 200.0, 960.0, ThreeSegmentShape(offset_j=500.0))
        assert low.slopes_w == pytest.approx(high.slopes_w)

    @pytest.mark.parametrize(
        ("arguments", "corners", "idle"),
        [
            ((0.6, 0.6, 3.5, 0.0, 900.0), 3, 900.0 / (2.9 * 0.96)),
            ((0.6, 0.5, 3.5, -5.0, 900.0), 3, 900.0 / (2.9 * 0.96)),
            ((0.6, 0.6 + 1e-12, 3.5, 80.0, 900.0), 3, 900.0 / (2.9 * 0.96)),
            ((0.6, 4.0, 3.5, 100.0, 10.0), 3, 0.0),
            ((0.0, 0.0, 0.0, 0.0, 0.0), 1, 0.0),
        ],
        ids=["optimum at full speed", "before full speed", "a rounding after it", "after the slowest", "zero length"],
    )
    def test_hard_predictions(self, arguments, corners, idle):
        profile, slope = three_segments(*arguments)
        assert profile.durations_s.size == corners
        assert (profile.d_min_s, profile.d_max_s) == (arguments[0], arguments[2])
        assert profile.is_convex
        assert slope == pytest.approx(idle)

    def test_predictions_that_are_no_numbers_are_refused(self):
        with pytest.raises(ValueError, match="finite"):
            three_segments(0.6, np.nan, 3.5, 1.0, 1.0)
        with pytest.raises(ValueError, match="d_min <= d_max"):
            three_segments(0.6, 0.6, 0.5, 1.0, 1.0)
