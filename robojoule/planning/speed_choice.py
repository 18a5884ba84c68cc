"""Speed limits on measured profiles, as the controller takes them and chosen together, and how sure a choice is.

Every motion takes one of the speed limits at which its profile is known (`robojoule.profile.measured`), so that nothing
is rounded afterwards: of all choices whose durations fit into a budget of time, the one of the least energy, what is
left of the time being waited where waiting is cheapest. Of nearly equal ones that is the one whose cycle time is surer:
an error of the cycle time is counted at what time is worth to the plan.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array, Index, Mask, frozen
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.calibration.timing import checked_durations, fit_all
from robojoule.calibration.timing_fit import RuleFit, rule_scores
from robojoule.calibration.timing_rules import Candidate
from robojoule.planning.batch import TreeBatch
from robojoule.planning.choice import Choice, least_cost_choice
from robojoule.profile.measured import MOST_DOUBT, MeasuredProfiles
from robojoule.profile.predicted import NORMAL_QUANTILE

TOLERANCE = 3e-5  # of the energy at full speed: by how much a better choice of speed limits may be missed
SECOND_TRIAL = 1.4  # cycle time of the second trial over the one asked for: room to slow single moves down
FASTEST_SECOND_TRIAL = 0.8
STILL_PROBABLE = 4.0  # of logarithms of probabilities: what a rule may be behind the best one
NOTICED = 1e-4  # of the cycle: less late than this counts as on time
LATE_SHIFT, LATE_SCALE = -0.19, 0.67  # of errors of cycle times over their stated deviations; see `late_probability`
DISCREPANCY = 0.5  # points of a saving that no figure of the model explains
DISCREPANCY_OF_TIMING = 0.5  # further points for each per cent of duration that the controller's rule does not explain


@dataclass(frozen=True)
class Outlook:
    """How sure a plan is.

    Attributes:
        rule: How the controller makes its time laws.
        cycle_deviation_s: Standard deviation of the cycle time; None where no timing was learnt. [s]
        late_probability: Probability that the cycle takes longer than asked for, reserve included, by more than
            `NOTICED` of it; None likewise. [-]
        saving_low_percent: Lower end of the interval that holds the saving with 90 %; None where energies were not
            measured or predicted. [%]
        saving_high_percent: Its upper end. [%]
    """

    rule: str
    cycle_deviation_s: float | None
    late_probability: float | None
    saving_low_percent: float | None = None
    saving_high_percent: float | None = None


def late_probability(margin_s: float, deviation_s: float, cycle_time_s: float) -> float:
    """Probability that a cycle is late. [-]

    Errors of the cycle times of plans on hidden machines (other draws of those of the study `close_the_loop`, eight
    kinds, half of them of a structure that no rule has), over the deviations that were stated, follow Student's t
    distribution with two degrees of freedom: most are smaller than a normal distribution has them, some much larger,
    and durations come out a little too long.

    Args:
        margin_s: What durations may be longer than planned until the cycle takes as long as was asked for. [s]
        deviation_s: Stated standard deviation of the cycle time. [s]
        cycle_time_s: Cycle time asked for. [s]
    """
    allowed_s = margin_s + NOTICED * cycle_time_s
    if deviation_s <= 0.0:
        return float(allowed_s < 0.0)
    x = (allowed_s / deviation_s - LATE_SHIFT) / LATE_SCALE
    return 0.5 * (1.0 - x / math.sqrt(2.0 + x * x))


def controller_limits(step: float, slowest: float) -> Array:
    """Speed limits that a controller takes: multiples of a step, and full speed, shape (S,). [-]"""
    count = math.floor(1.0 / step + 1e-9)
    limits = step * np.arange(1, count + 1)
    return frozen(np.unique(np.round(np.append(limits[limits >= slowest - 1e-9], 1.0), 12)))


def choose_speeds(
    profiles: MeasuredProfiles, budget_s: float, *, cautious: bool = False, allowed: Mask | None = None
) -> Index | None:
    """Speed limits of the least energy within a budget of time.

    Args:
        profiles: Profiles of the motions.
        budget_s: What the motions may take together. [s]
        cautious: Whether to go by the upper quantile of energy differences instead of the profiles themselves.
        allowed: Speed limits that may be chosen, shape (M, S); all that the profiles allow if not given.

    Returns:
        Of each motion, its place in the profiles' speed limits, shape (M,); None where the fastest ones do not fit.
    """
    found = choose_with_excess(profiles, budget_s, cautious=cautious, allowed=allowed)
    return None if found is None else found[0]


def choose_with_excess(
    profiles: MeasuredProfiles, budget_s: float, *, cautious: bool = False, allowed: Mask | None = None
) -> tuple[Index, float] | None:
    """Speed limits as `choose_speeds` has them, and by how much others may take less energy by the profiles. [J]"""
    energies = cautious_energies(profiles) if cautious else profiles.energy_j
    idle_j = profiles.idle_w.min() * profiles.duration_s
    costs, believed = energies - idle_j, profiles.energy_j - idle_j
    where = [np.flatnonzero(row) for row in (profiles.allowed if allowed is None else allowed)]
    tolerance = TOLERANCE * float(np.abs(energies[:, -1]).sum())
    tables = [row[at] for row, at in zip(profiles.duration_s, where, strict=True)]

    rows = np.arange(len(where))

    def least(costs_j: Array) -> Choice | None:
        options = [row[at] for row, at in zip(costs_j, where, strict=True)]
        return least_cost_choice(tables, options, budget_s, tolerance_j=tolerance)

    first = least(costs)
    if first is None:
        return None

    # The energy of a cautious plan is stated by the profiles themselves, by which others may take less.
    by_profiles = (least(believed) if cautious else first) or first

    def judged(places: Index) -> tuple[Index, float]:
        return places, max(float(believed[rows, places].sum()) - by_profiles.bound_j, 0.0)

    places = _places(first, where)
    deviation_s = profiles.cycle_deviation_s(places)
    if deviation_s <= 0.0:
        return judged(places)
    # The deviation, a root of a sum over motions, by its slope at the first choice: so costs stay those of motions.
    doubt_j = first.price_w * profiles.lasting_deviation_s**2 / (2.0 * deviation_s)
    least_j = sum(float(row[at].min()) for row, at in zip(doubt_j, where, strict=True))
    if float(doubt_j[rows, places].sum()) - least_j <= tolerance:
        return judged(places)
    surer = least(costs + doubt_j)
    return judged(places if surer is None else _places(surer, where))


def _places(choice: Choice, where: Sequence[Index]) -> Index:
    """Places in all speed limits of options among those that were allowed, shape (M,)."""
    return np.array([at[option] for at, option in zip(where, choice.options, strict=True)])


def cautious_energies(profiles: MeasuredProfiles) -> Array:
    """Energy at full speed plus the upper quantile of the difference to it, shape (M, S). [J]"""
    along = profiles.energy_gradient_j - profiles.energy_gradient_j[:, -1:]
    shared = np.einsum("msp,pq,msq->ms", along, profiles.energy_covariance, along, optimize=True)
    single = profiles.energy_deviation_j**2 + profiles.energy_deviation_j[:, -1:] ** 2
    single[:, -1] = 0.0
    return np.asarray(profiles.energy_j + NORMAL_QUANTILE * np.sqrt(np.maximum(shared, 0.0) + single))


def saving_interval(
    profiles: MeasuredProfiles,
    places: Index,
    given: Array,
    waits_s: tuple[Array, Array],
    others_j: tuple[float, float],
) -> tuple[float, float, float]:
    """Saving of a plan against the program as given, and the ends of the interval that holds it with 90 %. [%]

    Args:
        profiles: Profiles of the motions.
        places: Speed limits of the plan, shape (M,).
        given: Those of the program as given, shape (M,).
        waits_s: Waits of the plan and of the program as given at starts and ends of motions, in which motors hold, each
            of shape (M, 2). [s]
        others_j: Energy of process steps and of other waits, of both. [J]
    """
    rows = np.arange(len(places))
    energies, gradients, singles = [], [], []
    for at, waits, other_j in zip((places, given), waits_s, others_j, strict=True):
        energies.append(float(profiles.energy_j[rows, at].sum() + (profiles.idle_w * waits).sum() + other_j))
        along = profiles.energy_gradient_j[rows, at].sum(axis=0)
        gradients.append(along + np.einsum("me,mep->p", waits, profiles.idle_gradient_w))
        singles.append(profiles.energy_deviation_j[rows, at])
    plan_j, given_j = energies
    ratio = plan_j / given_j
    along = (gradients[0] - ratio * gradients[1]) / given_j
    single = np.where(places == given, (1.0 - ratio) * singles[0], np.hypot(singles[0], ratio * singles[1])) / given_j
    deviation = 100.0 * math.sqrt(
        max(float(along @ profiles.energy_covariance @ along), 0.0) + float((single**2).sum())
    )
    of_timing = DISCREPANCY_OF_TIMING * 100.0 * min(profiles.held_out_error, MOST_DOUBT)
    margin = NORMAL_QUANTILE * math.hypot(deviation, DISCREPANCY, of_timing)
    saving = 100.0 * (1.0 - ratio)
    return saving, saving - margin, saving + margin


def second_trial_limit(batch: TreeBatch, runs: MeasuredRuns, cycle_time_s: float, limits: Array) -> float:
    """Speed limit of all moves for a second trial, after one at full speed: room to slow single moves down. [-]

    Args:
        batch: The one tree.
        runs: Runs at one speed limit.
        cycle_time_s: Cycle time that the plan shall have. [s]
        limits: Speed limits that the controller takes, rising, shape (S,). [-]
    """
    durations = checked_durations(batch.paths, runs)
    fits = fit_all(batch.paths, durations, one_speed=True)
    waits = sum(vertex.least_prior_wait_s + vertex.least_post_wait_s for vertex in batch.graphs[0].vertices)
    return float(limits[second_trial_place(fits, 0, len(batch.paths.moving), cycle_time_s - waits, limits)])


def second_trial_place(fits: Sequence[RuleFit], place: int, motions: int, budget_s: float, limits: Array) -> int:
    """Place of the speed limit of a second trial: the lowest one that any rule asks for that explains the first one.

    Args:
        fits: Rules fitted to runs at one speed limit.
        place: Which set of runs.
        motions: Number of motions.
        budget_s: What the motions of the plan may take together. [s]
        limits: Speed limits that the controller takes, rising, shape (S,). [-]
    """
    scores = rule_scores(fits)[:, place]
    found = []
    for fit, score in zip(fits, scores.tolist(), strict=True):
        if score <= scores.min() + STILL_PROBABLE:
            x = fit.x[place : place + 1]
            totals = modelled_durations(fit.candidate, x, motions, limits)[0].sum(axis=0)
            found.append(trial_place(totals, SECOND_TRIAL * budget_s, limits))
    return min(found)


def modelled_durations(candidate: Candidate, x: Array, motions: int, limits: Array) -> Array:
    """Durations by a rule of every motion at every speed limit, shape (B, M, S). [s]"""
    every = np.repeat(np.arange(motions), limits.size)
    table, _ = candidate.evaluate(x, every, np.tile(np.tile(limits, motions), (len(x), 1)))
    return table.reshape(len(x), motions, limits.size)


def trial_place(totals_s: Array, budget_s: float, limits: Array) -> int:
    """Place of the lowest speed limit at which all motions together take no more than a budget."""
    fits = np.flatnonzero(totals_s <= budget_s)
    fastest = int(np.searchsorted(limits, FASTEST_SECOND_TRIAL + 1e-9)) - 1
    return min(int(fits[0]) if fits.size else fastest, max(fastest, 0))
