"""Plans as people get them: profiles of any source, whole speed limits, written back and told as a `Plan`."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.calibration.timing import POOR_ERROR_PERCENT, rule_doubts
from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.formats.program import Program
from robojoule.inputs import as_flag, shown
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun, simulate_trees
from robojoule.planning.cycle_time import cycle_time_s, reserve_s
from robojoule.planning.learnt_timing import with_learnt_timing
from robojoule.planning.measured_plans import plan_on_measurements, profiles_of_runs, within_range
from robojoule.planning.pareto import TradeOff, trade_off_on, trade_offs
from robojoule.planning.plan import Plan, is_as_good, plan_of, plan_warnings, verify, waiting_until
from robojoule.planning.predicted_motions import predicted_profiles, simulated_instead
from robojoule.planning.schedule import CYCLE_TIME_TOLERANCE_S
from robojoule.planning.source_plans import plan_on_source
from robojoule.planning.speed_choice import DISCREPANCY, Outlook, cautious_energies, late_probability
from robojoule.planning.whole_speeds import whole_speed_plan
from robojoule.planning.writeback import write_plans
from robojoule.profile.adaptive import AdaptiveProfiles
from robojoule.profile.predicted import NORMAL_QUANTILE, PredictedProfiles, ProfilePredictor
from robojoule.profile.source import ProfileSource
from robojoule.programs.operation_tree import OperationTree

Profiles = Literal["simulated", "predicted", "measured"]
RELATIVE_GAP = 8e-5  # proven gap of a plan at which no more runs are simulated


@dataclass(frozen=True)
class Wish:
    """What a plan shall be like.

    Attributes:
        cycle_time: Seconds, or a share above the cycle time of the program as given ("+10%").
        reserve: Slack at the end of the cycle: seconds, or a share of it ("1%").
        step_percent: Step of speed limits. [%]
        profiles: Where energies come from.
        cautious: Whether to plan by the upper quantile of energy differences.
        peak_power_w: Largest mains power that the cycle may draw; any if None. [W]
        predictor: What predicts profiles; the reference of the robot if None.
    """

    cycle_time: float | str
    reserve: float | str
    step_percent: float
    profiles: Profiles
    cautious: bool
    peak_power_w: float | None = None
    predictor: ProfilePredictor | None = None


def checked_profiles(profiles: object, *, with_runs: bool, cautious: object, with_model: bool = False) -> Profiles:
    """The source of profiles that is meant.

    Raises:
        InputError: There is no such source, or it does not go with what else is asked for.
    """
    cautious = as_flag(cautious, "cautious")
    if profiles is None:
        profiles = "measured" if with_runs else "predicted" if cautious or with_model else "simulated"
    if not isinstance(profiles, str) or profiles not in get_args(Profiles):
        raise InputError(
            f"unknown source of profiles {shown(profiles)}", key="profiles", allowed=", ".join(get_args(Profiles))
        )
    if profiles == "measured" and not with_runs:
        raise InputError("measured profiles need measured runs", key="runs", allowed="a table of runs")
    if profiles == "simulated" and cautious:
        allowed = "predicted or measured profiles"
        raise InputError("simulated profiles have no interval to be cautious by", key="cautious", allowed=allowed)
    if with_model and profiles != "predicted":
        raise InputError(f"a model serves predicted profiles, not {profiles} ones", key="model", allowed="predicted")
    return profiles  # type: ignore[return-value]


def planned(program: Program, batch: TreeBatch, full_speed: OperationTree, wish: Wish) -> Plan:
    """The plan of a program on simulated or predicted profiles.

    Args:
        program: The program.
        batch: Its tree, or what stands for it where moves may be faster.
        full_speed: The tree at full speed.
        wish: What the plan shall be like.
    """
    given, fastest = simulate_trees(batch, [[program.tree, full_speed]])[0]
    least_s = float(batch.least_cycles_s[0])
    # Where the power bounds the speeds, faster moves do not help.
    faster_s = fastest.cycle_time_s if wish.peak_power_w is None else None
    wanted_s = cycle_time_s(wish.cycle_time, given_s=given.cycle_time_s, least_s=least_s, faster_s=faster_s)
    kept_s = reserve_s(wish.reserve, wanted_s)
    if wanted_s - kept_s < least_s - CYCLE_TIME_TOLERANCE_S:
        raise CycleTimeTooShort(wanted_s, least_s + kept_s, None if faster_s is None else faster_s + kept_s)
    source = profile_source(batch, wish)
    asked_s = max(wanted_s - kept_s, least_s)
    schedule = plan_on_source(source, batch, np.array([[asked_s]]), relative_gap=RELATIVE_GAP).plans[0][0]
    whole = whole_speed_plan(source, batch, schedule, step_percent=wish.step_percent, reserve_s=kept_s)
    idle_w = float(batch.idle_post_w[-1])
    schedule = whole.schedule
    step_s = program.wait_step_s
    ideal = write_plans(batch, [[schedule]], whole.speed_limits[:, np.newaxis], wait_step_s=step_s)[0][0]
    written = program.placed(ideal)
    unused_s = max(ideal.added_waits_s - written.added_waits_s, 0.0)
    run = verify(batch, written, schedule, step_s + unused_s)
    is_allowed = wish.peak_power_w is None or given.peak_power_w <= wish.peak_power_w
    if kept_s == 0.0 and is_allowed and is_as_good(given, run):
        written, run = program.tree, given
    # Plans of the cycle without the dropped part of a step would take the bound again if they waited for that part.
    bound_j = schedule.bound_j - max(schedule.cycle_time_s - run.cycle_time_s, 0.0) * float(batch.idle_post_w.max())
    return plan_of(
        program,
        batch,
        written,
        (run, given, fastest),
        idle_w,
        least_cycle_time_s=least_s,
        bound_j=min(bound_j, run.energy_j),  # a plan that exists is above the bound but for rounding
        warnings=(
            *plan_warnings(written, run, given),
            *unused_warnings(unused_s, step_s),
            *(simulated_instead(batch) if wish.profiles == "predicted" else ()),
            *_timing_doubts(batch),
        ),
        reserve_s=kept_s,
        profiles=wish.profiles,
        outlook=_outlook(batch, source, run, kept_s, waiting_until(given, run.cycle_time_s, idle_w)),
    )


def unused_warnings(unused_s: float, step_s: float) -> tuple[str, ...]:
    """What to say of time that a program has no place to wait."""
    if unused_s <= step_s:
        return ()
    return (f"{unused_s:.3f} s are not used: every motion of the program runs more than once, so no wait fits in",)


def profile_source(batch: TreeBatch, wish: Wish) -> ProfileSource:
    """Simulated or predicted profiles of the motions of a batch."""
    if wish.profiles == "simulated":
        return AdaptiveProfiles(batch.planned, batch.speed_range[0], highest_speed_limit=batch.speed_range[1])
    found = predicted_profiles(batch, wish.predictor)
    return found.cautious() if wish.cautious else found


def _outlook(
    batch: TreeBatch, source: ProfileSource, run: CycleRun, kept_s: float, energy_given_j: float
) -> Outlook | None:
    """How sure a plan is by the error of a learnt controller and by predicted energies; None where neither is known."""
    controller = batch.robot.controller
    predicted = isinstance(source, PredictedProfiles)
    if controller is None and not predicted:
        return None
    deviation: float | None = None
    late: float | None = None
    if controller is not None:
        # Errors of single motions are taken as independent; what all motions share is not known.
        deviation = controller.duration_error * float(np.sqrt((run.durations_s**2).sum()))
        slack = float(run.prior_waits_s.sum() + run.post_waits_s.sum()) - required_s(batch)
        late = late_probability(max(slack, kept_s), deviation, run.cycle_time_s)
    low = high = None
    if isinstance(source, PredictedProfiles) and energy_given_j > 0.0:
        margin_j = _interpolated(source, source.cautious_j - source.energy_j, run.speed_limits).sum()
        margin = math.hypot(100.0 * float(margin_j) / energy_given_j, NORMAL_QUANTILE * DISCREPANCY)
        saving = 100.0 * (1.0 - run.energy_j / energy_given_j)
        low, high = saving - margin, saving + margin
    return Outlook(
        rule=controller.rule if controller is not None else "the entry's own",
        cycle_deviation_s=deviation,
        late_probability=late,
        saving_low_percent=low,
        saving_high_percent=high,
    )


def required_s(batch: TreeBatch) -> float:
    """What the waits and process steps of the one tree take. [s]"""
    return sum(vertex.least_prior_wait_s + vertex.least_post_wait_s for vertex in batch.graphs[0].vertices)


def _interpolated(source: PredictedProfiles, table: Array, limits: Array) -> Array:
    rows = zip(limits.tolist(), source.speed_limit, table, strict=True)
    return np.array([np.interp(at, grid, values) for at, grid, values in rows])


def planned_on_runs(program: Program, batch: TreeBatch, runs: MeasuredRuns, wish: Wish) -> Plan:
    """The plan of a program on measured runs of its moves; see `plan_on_measurements`."""
    found = plan_on_measurements(
        batch,
        runs,
        lambda given_s, least_s: cycle_time_s(wish.cycle_time, given_s=given_s, least_s=least_s),
        reserve=lambda seconds: reserve_s(wish.reserve, seconds),
        cautious=wish.cautious,
        speed_step=wish.step_percent / 100.0,
        every_move=wish.profiles == "measured",
        wait_step_s=program.wait_step_s,
        placed=program.placed,
        given_tree=program.tree,
    )
    return plan_of(
        program,
        batch,
        found.written,
        (found.run, found.given, found.fastest),
        float(found.idle_end_w),
        least_cycle_time_s=found.least_cycle_s,
        bound_j=found.bound_j,
        warnings=(*plan_warnings(found.written, found.run, found.given), *found.warnings),
        reserve_s=found.reserve_s,
        profiles=wish.profiles,
        outlook=found.outlook,
    )


def trade_off(
    batch: TreeBatch,
    profiles: Profiles,
    runs: MeasuredRuns | None,
    *,
    cautious: bool = False,
    predictor: ProfilePredictor | None = None,
) -> TradeOff:
    """Energy over cycle time of the one tree of a batch, on profiles of any source.

    Args:
        batch: The tree.
        profiles: Where energies come from.
        runs: Measured runs of its moves, if there are any; with simulated profiles they tell the timing alone.
        cautious: Whether to go by the upper quantile of energy differences.
        predictor: What predicts profiles; the reference of the robot if None.
    """
    if runs is None or profiles == "simulated":
        doubts: tuple[str, ...] = ()
        if runs is not None:
            batch, doubts = with_learnt_timing(batch, runs)
        if profiles == "simulated":
            return replace(trade_offs(batch)[0], warnings=(*_timing_doubts(batch), *doubts))
        wish = Wish(0.0, 0.0, 1.0, profiles, cautious, predictor=predictor)
        return trade_off_on(profile_source(batch, wish), batch)
    given = np.array([move.speed_limit_percent / 100.0 for move in batch.trees[0].moves()])
    known, _ = profiles_of_runs(batch, runs, given, speed_step=0.01)
    if cautious:
        known = replace(known, energy_j=cautious_energies(known))
    return replace(trade_off_on(within_range(batch, known), batch), warnings=rule_doubts(known.held_out_error, runs))


def _timing_doubts(batch: TreeBatch) -> tuple[str, ...]:
    """What to know about a timing that was learnt, a sentence each."""
    controller = batch.robot.controller
    if controller is None or not 100.0 * controller.duration_error > POOR_ERROR_PERCENT:
        return ()
    return (
        f"the controller's timing is known to {100.0 * controller.duration_error:.0f} % of a motion's duration only: "
        "keep a reserve, or learn it from runs by a finer clock",
    )
