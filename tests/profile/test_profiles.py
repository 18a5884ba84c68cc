"""Energy profiles against closed forms and brute force."""

from itertools import pairwise

import numpy as np
import pytest

from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.sampled import sampled_profile


def hull_by_brute_force(d, e):
    """Lower hull at the breakpoints: least value of all chords that span them."""
    return np.array(
        [
            min(
                np.interp(x, [d[i], d[j]], [e[i], e[j]]) if i < j else e[i]
                for i in range(len(d))
                for j in range(i, len(d))
                if d[i] <= x <= d[j] and (i < j or d[i] == x)
            )
            for x in d
        ]
    )


class TestPiecewise:
    def test_value_slopes_and_intercepts_describe_the_same_lines(self):
        profile = PiecewiseLinearProfile([1.0, 2.0, 4.0], [10.0, 6.0, 8.0])
        assert profile.value([1.0, 1.5, 3.0, 4.0]).tolist() == [10.0, 8.0, 7.0, 8.0]
        assert (profile.slopes_w * 2.0 + profile.intercepts_j).tolist() == [6.0, 6.0]
        assert (profile.d_min_s, profile.d_max_s, profile.segments) == (1.0, 4.0, 2)

    def test_it_cannot_be_changed(self):
        source = np.array([1.0, 2.0])
        profile = PiecewiseLinearProfile(source, [1.0, 2.0])
        source[0] = 5.0
        assert profile.d_min_s == 1.0
        with pytest.raises(ValueError, match="read-only"):
            profile.energies_j[0] = 0.0

    @pytest.mark.parametrize(
        ("durations", "energies"),
        [
            ([], []),
            ([1.0], [1.0, 2.0]),
            ([1.0, 1.0], [1.0, 2.0]),
            ([2.0, 1.0], [1.0, 2.0]),
            ([-1.0], [0.0]),
            ([1.0, np.nan], [1.0, 2.0]),
            ([1.0], [np.inf]),
        ],
        ids=["empty", "unequal", "twice", "falling", "negative", "nan duration", "infinite energy"],
    )
    def test_bad_breakpoints_are_refused(self, durations, energies):
        with pytest.raises(ValueError, match="profile"):
            PiecewiseLinearProfile(durations, energies)

    def test_outside_the_profile_there_is_no_value(self):
        with pytest.raises(ValueError, match="defined from 1 s to 2 s"):
            PiecewiseLinearProfile([1.0, 2.0], [1.0, 2.0]).value(2.1)

    def test_a_motion_of_zero_length_is_one_point(self):
        point = PiecewiseLinearProfile([0.0], [0.0])
        assert point.is_convex
        assert point.segments == 0
        assert point.convex_pieces()[0].d_max_s == 0.0
        assert point.value(0.0) == 0.0

    @pytest.mark.parametrize("seed", range(5))
    def test_lower_hull_is_the_brute_force_hull(self, seed):
        rng = np.random.default_rng(seed)
        d, e = np.cumsum(rng.uniform(0.1, 1.0, 12)), rng.uniform(100.0, 200.0, 12)
        hull = PiecewiseLinearProfile(d, e).lower_hull
        assert hull.is_convex
        assert hull.value(d) == pytest.approx(hull_by_brute_force(d, e), abs=1e-9)

    @pytest.mark.parametrize("seed", range(5))
    def test_convex_pieces_are_convex_and_join_to_the_profile(self, seed):
        rng = np.random.default_rng(seed)
        profile = PiecewiseLinearProfile(np.cumsum(rng.uniform(0.1, 1.0, 12)), rng.uniform(100.0, 200.0, 12))
        pieces = profile.convex_pieces()
        assert len(pieces) > 1
        assert all(piece.is_convex for piece in pieces)
        assert all(a.d_max_s == b.d_min_s for a, b in pairwise(pieces))
        for x in np.linspace(profile.d_min_s, profile.d_max_s, 200):
            inside = [p for p in pieces if p.d_min_s <= x <= p.d_max_s]
            assert min(float(p.value(x)) for p in inside) == pytest.approx(float(profile.value(x)), abs=1e-9)

    def test_numerical_noise_does_not_split_a_convex_profile(self):
        d = np.linspace(0.5, 3.0, 400)
        noise = 1e-9 * np.random.default_rng(0).uniform(-1.0, 1.0, d.size)
        profile = PiecewiseLinearProfile(d, 400.0 / d + 200.0 + 350.0 * d + noise)
        assert len(profile.convex_pieces()) == 1
        assert (np.diff(profile.convex_pieces()[0].slopes_w) > 0).all()


class TestMeasured:
    def test_equal_runs_are_one_point_with_the_lowest_speed_limit(self):
        profile = sampled_profile([3.0, 1.0, 1.0, 2.0], [30.0, 12.0, 12.0, 10.0], [0.1, 0.8, 1.0, 0.4])
        assert profile.durations_s.tolist() == [1.0, 2.0, 3.0]
        assert profile.speed_limits.tolist() == [0.8, 0.4, 0.1]
        assert (profile.saving_j, profile.penalty_j, profile.steepness_j_per_s) == (2.0, 20.0, 2.0)

    def test_a_higher_speed_limit_with_a_longer_run_is_left_out(self):
        profile = sampled_profile([3.0, 2.0, 2.2, 1.5], [9.0, 8.0, 99.0, 10.0], [0.1, 0.5, 0.6, 1.0])
        assert profile.durations_s.tolist() == [1.5, 2.0, 3.0]
        assert profile.energies_j.tolist() == [10.0, 8.0, 9.0]

    def test_the_fastest_run_is_kept_whatever_the_spacing(self):
        profile = sampled_profile([3.0, 1.0 + 4e-7, 1.0], [9.0, 11.0, 12.0], [0.1, 0.9, 1.0], spacing_s=1e-6)
        assert profile.durations_s.tolist() == [1.0, 3.0]
        assert profile.energies_j.tolist() == [12.0, 9.0]

    def test_nothing_is_steep_where_full_speed_is_best(self):
        assert sampled_profile([2.0, 1.0], [20.0, 10.0], [0.1, 1.0]).steepness_j_per_s == 0.0

    def test_bad_runs_are_refused(self):
        with pytest.raises(ValueError, match="same length"):
            sampled_profile([1.0, 2.0], [1.0], [0.5, 1.0])
        with pytest.raises(ValueError, match="finite"):
            sampled_profile([1.0, np.nan], [1.0, 2.0], [0.5, 1.0])
