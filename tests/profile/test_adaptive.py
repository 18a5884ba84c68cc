"""Adaptive profiles: they enclose the curve, keep the stated error and need few runs, where it is not convex too."""

import numpy as np
import pytest

from robojoule.motion.quadrature import run_quadrature
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.adaptive import LEAST_SPACING_S, AdaptiveProfiles
from robojoule.profile.enclosure import enclose
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload

ERROR = 1e-3
SLOWEST = 0.1
QUADRATURE_ERROR = 2e-4  # of the energies of these motions, where two zeros of the bus power lie between two nodes


@pytest.fixture(scope="module")
def paths():
    robot = load_robot("kuka_kr16_r2010_2", Payload(10.0, (0.0, 0.0, 0.1)))
    rng = np.random.default_rng(4)
    home = np.radians([0.0, -90.0, 90.0, 0.0, 0.0, 0.0])
    starts = home + rng.uniform(-0.6, 0.6, (12, 6))
    ends = home + rng.uniform(-0.6, 0.6, (12, 6))
    ends[0] = starts[0]  # no motion
    ends[1] = starts[1] + 1e-3  # a tiny one
    return MotionPaths(robot, starts, ends)


@pytest.fixture(scope="module")
def refined(paths):
    adaptive = AdaptiveProfiles(paths, SLOWEST)
    adaptive.refine(ERROR)
    return adaptive


@pytest.fixture(scope="module")
def finer(paths):
    return Finer(paths.robot, paths.start_rad, paths.start_rad + paths.delta_rad)


class Finer(MotionPaths):
    """The same motions integrated on eight times as many nodes, which see every change of the bus power's sign."""

    def _quadrature(self, path_nodes):
        return run_quadrature(8 * path_nodes)

    def subset(self, rows):
        return Finer(self.robot, self.start_rad[rows], (self.start_rad + self.delta_rad)[rows])


def dense(paths):
    top = np.maximum(paths.fastest_speed_limits(), SLOWEST)[:, None]
    return paths.simulate(np.clip(top + np.linspace(0.0, 1.0, 150) * (SLOWEST - top), SLOWEST, 1.0))


def assert_between(adaptive, curve, relative):
    for motion in range(adaptive.paths.motions):
        pair = adaptive.enclosure(motion)
        d, e = curve.duration_s[motion], curve.energy_j[motion]
        d = np.clip(d, pair.above.d_min_s, pair.above.d_max_s)
        assert (pair.above.value(d) >= e * (1.0 - relative)).all()
        # At d_min itself the energy is known, but the profile below is the neighbour's line.
        inside = d > pair.below.d_min_s + 1e-9
        assert (pair.below.value(d)[inside] <= e[inside] * (1.0 + relative)).all()


def test_the_true_curve_lies_between_both_profiles(finer):
    adaptive = AdaptiveProfiles(finer, SLOWEST)
    adaptive.refine(ERROR)
    assert_between(adaptive, dense(finer), 1e-6)


def test_the_true_curve_lies_between_simulated_profiles_up_to_the_error_of_the_simulation(paths, finer, refined):
    curve = dense(finer)
    assert dense(paths).energy_j == pytest.approx(curve.energy_j, rel=QUADRATURE_ERROR)
    assert_between(refined, curve, QUADRATURE_ERROR)


def test_both_profiles_differ_by_no_more_than_the_stated_error(paths, refined):
    for motion in range(1, paths.motions):
        pair, profile = refined.enclosure(motion), refined.profiles[motion]
        allowed = ERROR * profile.energies_j.min()
        wide = np.diff(profile.durations_s) > 4.0 * LEAST_SPACING_S
        assert pair.difference_j[wide].max(initial=0.0) <= allowed
        grid = np.linspace(pair.above.d_min_s, pair.above.d_max_s, 400)[1:]
        assert (pair.above.value(grid) - pair.below.value(grid)).max() <= allowed * (1.0 + 1e-9)
        at_runs = pair.above.value(profile.durations_s)
        assert at_runs == pytest.approx(profile.energies_j, rel=ERROR)


def test_runs_are_counted_and_as_many_equidistant_ones_are_worse(paths, refined):
    assert refined.runs.max() < 100
    assert refined.runs[0] == 1  # no motion: one point
    assert all(len(profile) <= count for profile, count in zip(refined.profiles, refined.runs, strict=True))
    top = np.maximum(paths.fastest_speed_limits(), SLOWEST)[:, None]
    most = refined.runs.max()
    shares = np.minimum(np.arange(most) / np.maximum(refined.runs - 1, 1)[:, None], 1.0)
    equidistant = paths.simulate(np.clip(top + shares * (SLOWEST - top), SLOWEST, 1.0))
    ratios = []
    for motion in range(2, paths.motions):
        runs = PiecewiseLinearProfile(*_rising(equidistant.duration_s[motion], equidistant.energy_j[motion]))
        ratios.append(enclose(runs).difference_j.max() / refined.enclosure(motion).difference_j.max())
    assert min(ratios) > 1.2


def _rising(durations, energies):
    durations, first = np.unique(durations, return_index=True)
    return durations, energies[first]


def test_what_costs_more_than_waiting_is_not_refined(paths):
    everything, useful = AdaptiveProfiles(paths, SLOWEST), AdaptiveProfiles(paths, SLOWEST)
    everything.refine(5e-3)
    useful.refine(5e-3, highest_slope_w=0.0)
    assert useful.runs.sum() < everything.runs.sum()
    for motion in range(1, paths.motions):
        pair, profile = useful.enclosure(motion), useful.profiles[motion]
        to_best = np.flatnonzero(np.diff(profile.durations_s) > 4.0 * LEAST_SPACING_S)
        to_best = to_best[to_best < profile.optimum]
        assert (pair.difference_j[to_best] <= 5e-3 * profile.energies_j.min()).all()


def test_same_motions_give_the_same_profiles(paths, refined):
    again = AdaptiveProfiles(paths, SLOWEST)
    again.refine(ERROR)
    for one, other in zip(again.profiles, refined.profiles, strict=True):
        assert one.durations_s.tobytes() == other.durations_s.tobytes()
        assert one.energies_j.tobytes() == other.energies_j.tobytes()


def test_an_error_must_be_asked_for(paths):
    with pytest.raises(ValueError, match="must be positive"):
        AdaptiveProfiles(paths, SLOWEST).refine(0.0)
