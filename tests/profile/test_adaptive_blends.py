"""Adaptive profiles of blended and tied motions, whose laws change where a leg or a corner saturates."""

import numpy as np
import pytest

from robojoule.motion.blends import BlendedPaths
from robojoule.motion.groups import TiedMotions
from robojoule.profile.adaptive import AdaptiveProfiles
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload
from tests.core_cases import kr16
from tests.motion.chains import random_chain, random_chains

LIMITS = np.linspace(0.1, 1.0, 300)
ERROR = 1e-3
CASES = {
    "chains": lambda: BlendedPaths(kr16(5.0), random_chains(kr16())),
    "other arm": lambda: BlendedPaths(load_robot("ur_ur10e", Payload(5.0)), random_chains(load_robot("ur_ur10e"))),
    "own bounds": lambda: BlendedPaths(
        kr16(5.0),
        [random_chain(kr16(), 3, seed=2)],
        (np.array([0.1, 0.5, 0.2]), np.array([1.0, 0.5, 0.7])),
    ),
    "tied": lambda: TiedMotions(
        BlendedPaths(kr16(5.0), [random_chain(kr16(), legs, seed=legs) for legs in (2, 4, 3)]), np.array([0, 0, 0])
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_above_and_below_hold_between_the_runs(case):
    """Dense runs lie between both within the stated error, and both are as near to each other as was asked for."""
    paths = CASES[case]()
    source = AdaptiveProfiles(paths, 0.1)
    source.refine(ERROR)
    runs = paths.simulate(LIMITS)
    for motion in np.flatnonzero(paths.moving).tolist():
        known = source.enclosure(motion)
        duration, energy = runs.duration_s[motion], runs.energy_j[motion]
        at = np.clip(duration, known.above.d_min_s, known.above.d_max_s)
        least = energy.min()
        assert (known.above.value(at) - energy).min() >= -ERROR * least, motion
        assert (energy - known.below.value(at)).min() >= -ERROR * least, motion
        if case != "own bounds":  # where moves keep their own, one duration has many speed limits
            assert (known.above.value(at) - energy).max() <= 2.0 * ERROR * least, motion


def test_kinks_are_where_the_slope_of_durations_jumps():
    """Of a chain of three legs: away from them durations are smooth functions of the speed limit."""
    paths = BlendedPaths(kr16(5.0), [random_chain(kr16(), 3, seed=4)])
    (kinks,) = paths.kinks()
    limits = np.linspace(0.05, 0.98, 4000)
    bends = np.abs(np.diff(paths.durations(limits)[0] * limits, 3))
    clear = np.abs(limits[2:-1, None] - kinks).min(axis=1) > 0.02
    assert bends[clear].max() < 0.02 * bends.max()
    assert kinks.size > 1
