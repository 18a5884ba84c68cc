"""Trials of a tree on a hidden machine: run, learn, plan, run the plan, learn again.

The first trial is a run at full speed and one at the lower speed limit that the planner asks for; the plan made from
both is executed, which is the second trial. A planner sees durations by stamps, noisy energies and the
catalog entry, no more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reproduction.closed_loop.machines import PERCENT, MachineTable
from reproduction.tables import Row
from robojoule.arrays import Array, Index
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.calibration.timing_fit import Durations, RuleFit, fit_rule
from robojoule.calibration.timing_rules import candidates
from robojoule.motion.simulation import MotionPaths
from robojoule.planning.choice import least_cost_choice
from robojoule.planning.speed_choice import (
    choose_speeds,
    late_probability,
    saving_interval,
    second_trial_place,
)
from robojoule.profile.measured import BELOW_MEASURED, MeasuredProfiles, Measurement
from robojoule.profile.sampled import sampled_profile

FULL = PERCENT.size - 1
HALVES = np.arange(20, 201) / 200.0  # speed limits of plans without trials, which were never rounded
_TOLERANCE_J = 0.05


@dataclass(frozen=True)
class Trial:
    """How a machine is looked at.

    Attributes:
        stamp_s: Resolution of the instants at which motions begin and end. [s]
        energy_noise: Standard deviation of a motion's measured energy, relative. [-]
        draws: Number of noise draws.
        reserve: Slack kept by the plans with reserve, over the cycle time. [-]
    """

    stamp_s: float
    energy_noise: float
    draws: int
    reserve: float


class Seen:
    """What B draws of noise show of runs of M motions, run after run."""

    def __init__(self, machine: MachineTable, trial: Trial, rng: np.random.Generator) -> None:
        self.machine, self.trial, self.rng = machine, trial, rng
        self.motions = len(machine.duration_s)
        self.motion: Index = np.zeros(0, dtype=np.intp)
        self.limits, self.duration_s, self.energy_j = (np.zeros((trial.draws, 0)) for _ in range(3))

    def run(self, places: Index) -> None:
        """Run all motions once.

        Args:
            places: Speed limits by their place in `PERCENT`, shape (B, M).
        """
        rows = np.arange(self.motions)
        true_s = self.machine.duration_s[rows, places]
        true_s = true_s + self.machine.jitter_s * self.rng.standard_normal(places.shape)
        stamp = self.trial.stamp_s
        phase = self.rng.uniform(0.0, stamp, (len(places), 1))
        instants = np.concatenate([phase, phase + np.cumsum(true_s, axis=1)], axis=1)
        seen_s = np.diff(np.floor(instants / stamp) * stamp, axis=1)
        noise = 1.0 + self.trial.energy_noise * self.rng.standard_normal(places.shape)
        self.motion = np.concatenate([self.motion, rows])
        self.limits = np.concatenate([self.limits, PERCENT[places]], axis=1)
        self.duration_s = np.concatenate([self.duration_s, np.maximum(seen_s, stamp)], axis=1)
        self.energy_j = np.concatenate([self.energy_j, self.machine.energy_j[rows, places] * noise], axis=1)

    def durations(self) -> Durations:
        """All draws as data sets of one fit."""
        return Durations.of(self.motion, self.limits, self.duration_s, self.trial.stamp_s)

    def runs(self, draw: int) -> MeasuredRuns:
        """One draw as a user has it."""
        return MeasuredRuns(
            "trials", self.motion, self.limits[draw], self.duration_s[draw], self.energy_j[draw], self.trial.stamp_s
        )


class TreeOfMachine:
    """One tree on one machine, planned for some cycle times.

    Args:
        paths: Its motions by the catalog entry.
        measurement: The same made ready for runs.
        machine: What the machine does.
        key: Columns that name the case.
    """

    def __init__(self, paths: MotionPaths, measurement: Measurement, machine: MachineTable, key: Row) -> None:
        self.paths, self.measurement, self.machine, self.key = paths, measurement, machine, key
        self.at_one_speed = candidates(paths, (0.0,))
        self.at_many_speeds = candidates(paths)
        self.rows = np.arange(paths.motions)
        nominal = paths.simulate(HALVES)
        self.nominal_s, self.nominal_j = nominal.duration_s, nominal.energy_j
        self.optima: dict[float, float] = {}
        self.nominal_idle_w = float(min(paths.idle_power_start_w.min(), paths.idle_power_end_w.min()))

    def cases(self, percent: float, trial: Trial, rng: np.random.Generator) -> list[Row]:
        """Plans for one cycle time by all draws: a row for each draw and trial.

        Args:
            percent: Cycle time over the machine's own least one. [%]
            trial: How the machine is looked at.
            rng: Source of the noise.
        """
        wanted_s = percent / 100.0 * self.machine.fastest_s
        seen = Seen(self.machine, trial, rng)
        seen.run(np.full((trial.draws, len(self.rows)), FULL))
        one_ratio = [self._by_ratios(seen.duration_s[draw], wanted_s) for draw in range(trial.draws)]
        seen.run(self._second(seen, wanted_s))
        nominal = self._late_percent(self._nominal(self.nominal_s, wanted_s), wanted_s)
        rows: list[Row] = []
        for number in (1, 2):
            durations = seen.durations()
            fits = [fit_rule(candidate, durations) for candidate in self.at_many_speeds]
            places = np.empty((trial.draws, len(self.rows)), dtype=np.intp)
            for draw in range(trial.draws):
                told, places[draw] = self._plan(seen, durations, fits, draw, wanted_s)
                late = {
                    # No plan can foresee what a cycle's motions differ by from the last one's.
                    "own_deviation_percent": 100.0 * self.machine.jitter_s * len(self.rows) ** 0.5 / wanted_s,
                    "late_nominal_percent": nominal,
                    "late_one_ratio_percent": self._late_percent(one_ratio[draw], wanted_s),
                }
                rows.append(self.key | {"cycle_time_percent": percent, "draw": draw, "trial": number} | told | late)
            seen.run(places)
        return rows

    def _second(self, seen: Seen, wanted_s: float) -> Index:
        """Speed limit of the second run of the first trial, shape (B, M)."""
        durations = seen.durations()
        fits = [fit_rule(candidate, durations) for candidate in self.at_one_speed]
        draws = range(seen.trial.draws)
        places = [second_trial_place(fits, draw, len(self.rows), wanted_s, PERCENT) for draw in draws]
        return np.repeat(np.array(places)[:, None], len(self.rows), axis=1)

    def _plan(
        self, seen: Seen, durations: Durations, fits: list[RuleFit], draw: int, wanted_s: float
    ) -> tuple[Row, Index]:
        runs = seen.runs(draw)
        first = int(np.searchsorted(PERCENT, BELOW_MEASURED * runs.speed_limits.min() - 1e-9))
        profiles = self.measurement.profiles(runs, durations, fits, draw, PERCENT[first:])
        found = choose_speeds(profiles, wanted_s)
        kept = choose_speeds(profiles, wanted_s * (1.0 - seen.trial.reserve))
        fastest = np.full(len(self.rows), profiles.speed_limits.size - 1)
        found = fastest if found is None else found
        kept = fastest if kept is None else kept
        told = self._told(first + found, wanted_s)
        saving, low, high = self._promise(profiles, found, wanted_s)
        planned_s = float(profiles.duration_s[self.rows, found].sum())
        real = float(str(told["real_saving_percent"]))
        deviation = profiles.cycle_deviation_s(found)
        return told | {
            "promised_saving_percent": saving,
            "promise_held": low <= real <= high,
            "late_probability": late_probability(wanted_s - planned_s, deviation, wanted_s),
            "late_with_reserve_percent": self._late(first + kept, wanted_s),
            "second_limit_percent": 100.0 * float(runs.speed_limits[len(self.rows)]),
            "rule": profiles.rule,
        }, first + found

    def _promise(self, profiles: MeasuredProfiles, places: Index, wanted_s: float) -> tuple[float, float, float]:
        """The saving that the planner states, and its interval, against full speed and waiting. [%]"""
        fastest = np.full(len(places), profiles.speed_limits.size - 1)
        waits = []
        for at in (places, fastest):
            wait = np.zeros_like(profiles.idle_w)
            left_s = wanted_s - float(profiles.duration_s[self.rows, at].sum())
            wait[np.unravel_index(int(profiles.idle_w.argmin()), wait.shape)] = max(left_s, 0.0)
            waits.append(wait)
        return saving_interval(profiles, places, fastest, (waits[0], waits[1]), (0.0, 0.0))

    def _told(self, places: Index, wanted_s: float) -> Row:
        """What a plan really takes and costs on the machine."""
        idle_w = float(self.machine.idle_w.min())
        taken_s = float(self.machine.duration_s[self.rows, places].sum())
        real_j = float(self.machine.energy_j[self.rows, places].sum()) + max(wanted_s - taken_s, 0.0) * idle_w
        fast_s, fast_j = self.machine.duration_s[:, FULL].sum(), self.machine.energy_j[:, FULL].sum()
        given_j = float(fast_j + (wanted_s - fast_s) * idle_w)
        if wanted_s not in self.optima:
            self.optima[wanted_s] = self._optimum(wanted_s, idle_w)
        best_j = self.optima[wanted_s]
        return {
            "late_percent": self._late(places, wanted_s),
            "gap_percent": 100.0 * (real_j / best_j - 1.0),
            "real_saving_percent": 100.0 * (1.0 - real_j / given_j),
        }

    def _late(self, places: Index, wanted_s: float) -> float:
        """By how much a plan takes too long on the machine, its jitter apart. [%]"""
        taken_s = float(self.machine.duration_s[self.rows, places].sum())
        return 100.0 * max(taken_s - wanted_s, 0.0) / wanted_s

    def _optimum(self, wanted_s: float, idle_w: float) -> float:
        """Least energy of the machine for a cycle time, between whole percents too: a lower bound. [J]"""
        slopes, lengths, energy, left = [], [], 0.0, wanted_s
        for durations, energies in zip(self.machine.duration_s, self.machine.energy_j, strict=True):
            hull = sampled_profile(durations, energies, PERCENT).piecewise().lower_hull
            slopes.append(hull.slopes_w)
            lengths.append(np.diff(hull.durations_s))
            energy += float(hull.energies_j[0])
            left -= hull.d_min_s
        slope, length = np.concatenate(slopes), np.concatenate(lengths)
        order = np.argsort(slope, kind="stable")
        order = order[slope[order] < idle_w]
        used = np.clip(left - np.append(0.0, np.cumsum(length[order])[:-1]), 0.0, length[order])
        return energy + float(slope[order] @ used) + idle_w * (left - float(used.sum()))

    def _nominal(self, durations_s: Array, wanted_s: float) -> Index:
        """Speed limits by nominal energies and some durations, as places in `HALVES`, shape (M,)."""
        costs = self.nominal_j - self.nominal_idle_w * durations_s
        choice = least_cost_choice(list(durations_s), list(costs), wanted_s, tolerance_j=_TOLERANCE_J)
        return np.full(len(self.rows), HALVES.size - 1) if choice is None else np.array(choice.options)

    def _late_percent(self, halves: Index, wanted_s: float) -> float:
        """By how much a plan in half percents, as places in `HALVES`, takes too long on the machine. [%]"""
        below, above = halves // 2, (halves + 1) // 2
        at_below, at_above = (self.machine.duration_s[self.rows, at] for at in (below, above))
        taken = at_below if self.machine.whole_percents else (at_below + at_above) / 2.0
        return 100.0 * max(float(taken.sum()) - wanted_s, 0.0) / wanted_s

    def _by_ratios(self, seen_s: Array, wanted_s: float) -> Index:
        """The same where each motion's durations are nominal ones times a ratio seen at full speed, shape (M,)."""
        ratio = seen_s[: len(self.rows)] / self.nominal_s[:, -1]
        return self._nominal(self.nominal_s * ratio[:, None], wanted_s)
