"""Methods of a study: those of the plan experiment with what a study knows, and planning on any source of profiles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from reproduction.experiment.gaps import PlanEnergies
from reproduction.experiment.outcomes import cycle_times_s, simulate_plans
from reproduction.methods.greedy import Greedy
from reproduction.methods.krc_polynomial import KrcPolynomial
from reproduction.methods.method import Method
from reproduction.methods.optimum import Optimum
from reproduction.methods.predicted_three_segment import PredictedThreeSegment
from reproduction.methods.three_segment_profile import ThreeSegmentShape
from reproduction.methods.uniform import Uniform
from reproduction.methods.unoptimized import Unoptimized
from reproduction.study.cases import PlantBatch
from robojoule.arrays import Array
from robojoule.motion.simulation import MotionPaths
from robojoule.planning.chain import chain_plans
from robojoule.profile.enclosure import Enclosure
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.sampled import sampled_profiles

GREEDY_SPEED_LIMITS = 10


@dataclass(frozen=True, eq=False)
class FixedProfiles:
    """Profiles that are given once and for all (a `ProfileSource`).

    Attributes:
        profiles: Of the M motions.
        idle_start_w: Idle power at the start of each motion, shape (M,). [W]
        idle_end_w: Idle power at its end, shape (M,). [W]
    """

    profiles: Sequence[PiecewiseLinearProfile]
    idle_start_w: Array
    idle_end_w: Array

    def enclosure(self, motion: int) -> Enclosure:
        """The profile, which is all that is known."""
        return Enclosure.exact(self.profiles[motion])

    def refine_near(self, durations_s: Mapping[int, Array]) -> list[int]:
        """There is no more to tell; see `ProfileSource.refine_near`."""
        return []


def hull_profiles(paths: MotionPaths, speed_limits: Array) -> FixedProfiles:
    """Lower hulls of the profiles that a simulation of `paths` gives at speed limits, shape (M, S), and idle power."""
    runs = paths.simulate(speed_limits)
    sampled = sampled_profiles(runs.duration_s, runs.energy_j, speed_limits)
    hulls = [profile.piecewise().lower_hull for profile in sampled]
    return FixedProfiles(hulls, paths.idle_power_start_w, paths.idle_power_end_w)


def polynomial_method(batch: PlantBatch, segments: int, slowest_percent: float) -> Method:
    """The original plug-in: five runs of the plant, Eq. 3.1, equidistant chords, true idle power."""
    return KrcPolynomial(segments, "speed", batch.idle_post_w, slowest_percent / 100.0, chain_plans)


def three_segment_method(parameters: Array) -> PredictedThreeSegment:
    """The thesis's predictor: three numbers of each motion (saving, optimal duration, penalty), shape (M, 3)."""
    return PredictedThreeSegment(parameters, ThreeSegmentShape(), chain_plans)


def evaluate_plans(
    batch: PlantBatch, methods: Mapping[str, Method], cycle_times_percent: Sequence[float], dense_speed_limits: int
) -> PlanEnergies:
    """Plan every tree by every method and simulate the plans on the plant.

    Args:
        batch: Trees on their plant.
        methods: Methods by their name in the study.
        cycle_times_percent: Cycle times as shares of the least one. [%]
        dense_speed_limits: Speed limits of the true profiles for the optimum.

    Returns:
        Energies, also of `unoptimized`, `uniform`, `greedy` and `optimum`.
    """
    limits = batch.speed_limits(GREEDY_SPEED_LIMITS)
    runs = batch.paths.simulate(limits)
    simulated = sampled_profiles(runs.duration_s, runs.energy_j, limits)
    compared: dict[str, Method] = {
        "unoptimized": Unoptimized(),
        "uniform": Uniform(),
        "greedy": Greedy(simulated, GREEDY_SPEED_LIMITS),
        **methods,
        "optimum": Optimum(dense_speed_limits),
    }
    times = cycle_times_s(batch, cycle_times_percent)
    outcomes = simulate_plans(batch, [method.plan(batch, times) for method in compared.values()])
    energies = {name: outcome.energy_j for name, outcome in zip(compared, outcomes, strict=True)}
    return PlanEnergies(tuple(cycle_times_percent), energies)
