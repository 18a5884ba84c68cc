"""Plans on measured runs of a program's own moves (`robojoule.planning.speed_choice`), told as any plan is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from robojoule.arrays import Array, Index, Mask
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.calibration.timing import rule_doubts
from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.formats.program import WAIT_STEP_S
from robojoule.inputs import counted
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun, simulate_trees, standing_energies_j
from robojoule.planning.schedule import Schedule
from robojoule.planning.speed_choice import (
    TOLERANCE,
    Outlook,
    cautious_energies,
    choose_with_excess,
    controller_limits,
    late_probability,
    saving_interval,
    second_trial_limit,
)
from robojoule.planning.standstills import standing, standstills_of
from robojoule.planning.tree_motions import closes
from robojoule.planning.whole_speeds import FoundSpeeds, SpeedSearch
from robojoule.planning.writeback import write_plan
from robojoule.profile.measured import BELOW_MEASURED, MeasuredProfiles, measured_profiles
from robojoule.programs.operation_tree import OperationTree
from robojoule.robots.robot import Robot
from robojoule.robots.standby import standing_energy_j

SAME_TIME_S = 1e-3  # of waits: below, nothing is left to be used
_ROUNDING_S = 1e-9  # of sums of durations


@dataclass(frozen=True, eq=False)
class MeasuredPlan:
    """A plan on measured runs, before it is told to people.

    Attributes:
        written: The tree with the plan.
        run: One cycle of it, by the profiles.
        bound_j: No plan takes less, by the profiles. [J]
        given: One cycle of the program as given, by the profiles.
        fastest: One cycle at full speed, by the profiles.
        least_cycle_s: Least cycle time by the profiles. [s]
        reserve_s: Slack that is kept at the end. [s]
        idle_end_w: Idle power where the cycle ends. [W]
        outlook: How sure the plan is.
        warnings: What to know of the runs, a sentence each.
    """

    written: OperationTree
    run: CycleRun
    bound_j: float
    given: CycleRun
    fastest: CycleRun
    least_cycle_s: float
    reserve_s: float
    idle_end_w: float
    outlook: Outlook
    warnings: tuple[str, ...]


def plan_on_measurements(
    batch: TreeBatch,
    runs: MeasuredRuns,
    cycle_time: Callable[[float, float], float],
    *,
    reserve: Callable[[float], float] = lambda cycle_time_s: 0.0,
    cautious: bool = False,
    speed_step: float = 0.01,
    every_move: bool = True,
    wait_step_s: float = WAIT_STEP_S,
    placed: Callable[[OperationTree], OperationTree] = lambda tree: tree,
    given_tree: OperationTree | None = None,
) -> MeasuredPlan:
    """Plan the one tree of a batch on measured runs of its moves.

    Args:
        batch: The tree, on the nominal robot.
        runs: Measured runs of its moves.
        cycle_time: Cycle time asked for, from that of the program as given and the least one. [s]
        reserve: Slack that is kept at the end of the cycle, from the cycle time. [s]
        cautious: Whether to plan by the upper quantile of energy differences.
        speed_step: Step of the speed limits that the controller takes. [-]
        every_move: Whether runs of every move at two speed limits or more are demanded.
        wait_step_s: Step of added waits. [s]
        placed: Moves added waits to where the program can say them.
        given_tree: The program as given, where its speeds do not bound the plan; the tree of the batch if not given.

    Raises:
        InputError: Runs are missing: names the move, or the speed limit at which to run the program once more.
        CycleTimeTooShort: A cycle time in which the fastest cycle does not fit.
    """
    tree, graph = batch.trees[0], batch.graphs[0]
    as_given = tree if given_tree is None else given_tree
    as_written, at_full = simulate_trees(batch, [[as_given, tree.without_plan(full_speed=True)]])[0]
    profiles, limits = profiles_of_runs(batch, runs, as_written.speed_limits, speed_step)
    taken = np.isin(profiles.speed_limits, limits) | (profiles.speed_limits == batch.speed_range[1][:, None])
    given = believed(as_written, profiles, batch.robot, as_given)
    fastest = believed(at_full, profiles, batch.robot, tree)
    waits = np.array([[v.least_prior_wait_s, v.least_post_wait_s] for v in graph.vertices])
    allowed = profiles.allowed & taken & _within(batch, profiles)
    least_s = float(np.where(allowed, profiles.duration_s, np.inf).min(axis=1).sum() + waits.sum())
    wanted_s = cycle_time(given.cycle_time_s, least_s)
    if np.unique(runs.speed_limits).size == 1:
        every = controller_limits(speed_step, batch.slowest_speed_limit)
        second = 100.0 * second_trial_limit(batch, runs, wanted_s, every)
        raise InputError(
            "all runs have one speed limit, which says nothing of slower ones",
            file=runs.source,
            allowed=f"runs with all moves at {second:g} % as well",
        )
    if every_move:
        check_measured(batch, runs, np.flatnonzero(batch.paths.moving).tolist())
    reserve_s = reserve(wanted_s)
    if wanted_s - reserve_s < least_s - _ROUNDING_S:
        raise CycleTimeTooShort(wanted_s, least_s + reserve_s)
    required_s = float(waits.sum()) + reserve_s
    if batch.robot.standby:
        waits[-1, 1] += reserve_s
        places, waits, excess_j = _with_standby(batch, profiles, waits, wanted_s, cautious, allowed)
    else:
        found = choose_with_excess(profiles, wanted_s - required_s, cautious=cautious, allowed=allowed)
        if found is None:
            raise CycleTimeTooShort(wanted_s, least_s + reserve_s)
        places, excess_j = found
    rows = np.arange(len(places))
    durations = profiles.duration_s[rows, places]
    slack_s = wanted_s - required_s - float(durations.sum())
    if not batch.robot.standby:
        waits[np.unravel_index(int(profiles.idle_w.argmin()), waits.shape)] += slack_s
        waits[-1, 1] += reserve_s
    ends = np.cumsum(waits.sum(axis=1) + durations)
    schedule = Schedule(
        status="optimal",
        cycle_time_s=wanted_s,
        durations_s=durations,
        prior_waits_s=waits[:, 0],
        post_waits_s=waits[:, 1],
        collision_waits_s=np.zeros(len(rows)),
        starts_s=ends - waits[:, 1] - durations,
    )
    written = placed(write_plan(tree, graph, schedule, profiles.speed_limits[places], durations, wait_step_s))
    learnt = simulate_trees(learnt_batch(batch, profiles), [[written]])[0][0]
    run = believed(learnt, profiles, batch.robot, written)
    others_j = given.energy_j - float(given.vertex_energies_j.sum())
    given_waits = np.stack([given.prior_waits_s, given.post_waits_s], axis=1)
    given_waits[-1, 1] += max(run.cycle_time_s - given.cycle_time_s, 0.0)
    at = np.argmin(np.abs(profiles.speed_limits - given.speed_limits[:, None]), axis=1)
    closed = closes(tree)
    held, standby_j = zip(*(_held(batch, profiles, each, closed) for each in (waits, given_waits)), strict=True)
    _, low, high = saving_interval(profiles, places, at, held, (others_j + standby_j[0], others_j + standby_j[1]))
    deviation = profiles.cycle_deviation_s(places)
    measured_energies = bool(np.isfinite(runs.energy_j).any())
    outlook = Outlook(
        rule=profiles.rule,
        cycle_deviation_s=deviation,
        late_probability=late_probability(slack_s + reserve_s, deviation, wanted_s),
        saving_low_percent=low if measured_energies else None,
        saving_high_percent=high if measured_energies else None,
    )
    warnings = _warnings(profiles, runs, places, slack_s, allowed)
    return MeasuredPlan(
        written,
        run,
        run.energy_j - excess_j,
        given,
        fastest,
        least_s,
        reserve_s,
        float(profiles.idle_w[-1, 1]),
        outlook,
        warnings,
    )


def _warnings(
    profiles: MeasuredProfiles, runs: MeasuredRuns, places: Index, slack_s: float, allowed: Mask
) -> tuple[str, ...]:
    """What the runs leave open: slower moves might save more, but how slow ones behave was not measured."""
    doubts = rule_doubts(profiles.held_out_error, runs)
    lowest = allowed.argmax(axis=1)
    stuck = int(np.count_nonzero((places == lowest) & (allowed.sum(axis=1) > 1)))
    if slack_s <= SAME_TIME_S or stuck == 0:
        return doubts
    moves = counted(stuck, "move") if stuck > 1 else "a move"
    return (*doubts, f"{moves} at the lowest speed limit that was measured: slower runs may save more")


def profiles_of_runs(
    batch: TreeBatch, runs: MeasuredRuns, given: Array, speed_step: float
) -> tuple[MeasuredProfiles, Array]:
    """Profiles at all speed limits that the controller takes and others that are asked for, and the former, (S,). [-]

    Args:
        batch: The one tree.
        runs: Measured runs of its moves.
        given: Speed limits of the program as given, shape (M,). [-]
        speed_step: Step of the speed limits that the controller takes. [-]
    """
    known = min(BELOW_MEASURED * float(runs.speed_limits.min()), float(given.min()))
    limits = controller_limits(speed_step, max(batch.slowest_speed_limit, known))
    others = np.concatenate([runs.speed_limits, given, batch.speed_range[1]])
    return measured_profiles(batch.paths, runs, np.unique(np.append(limits, others))), limits


def within_range(batch: TreeBatch, profiles: MeasuredProfiles) -> MeasuredProfiles:
    """The profiles at the speed limits that the program allows."""
    return replace(profiles, allowed=profiles.allowed & _within(batch, profiles))


def _with_standby(
    batch: TreeBatch,
    profiles: MeasuredProfiles,
    required_s: Array,
    cycle_s: float,
    cautious: bool,
    allowed: Mask,
) -> tuple[Index, Array, float]:
    """Speed limits (M,) as places in the profiles', and waits (M, 2) [s], by the standby modes of the controller.

    The third is by how much others may take less energy. [J]
    """
    places = standstills_of(
        required_s, profiles.idle_w, batch.robot.standby, closed=closes(batch.trees[0]), step_s=WAIT_STEP_S
    )
    energies = cautious_energies(profiles) if cautious else profiles.energy_j
    where = [np.flatnonzero(row) for row in allowed]
    search = SpeedSearch(places, cycle_s, TOLERANCE * float(np.abs(energies[:, -1]).sum()))
    durations = [row[at] for row, at in zip(profiles.duration_s, where, strict=True)]

    def best_by(table_j: Array) -> FoundSpeeds:
        return search.best(places.offers(), durations, [row[at] for row, at in zip(table_j, where, strict=True)])

    best = best_by(energies)
    chosen_s = sum(float(one[k]) for one, k in zip(durations, best.motions, strict=True))
    waits = best.waits_s(places, required_s, cycle_s - chosen_s)
    chosen = np.array([at[k] for at, k in zip(where, best.motions, strict=True)])
    # The energy of a cautious plan is stated by the profiles themselves, by which others may take less.
    caution_j = float((energies - profiles.energy_j)[np.arange(len(chosen)), chosen].sum())
    bound_j = (best_by(profiles.energy_j) if cautious else best).bound_j
    return chosen, waits, max(best.energy_j - caution_j - bound_j, 0.0)


def _held(batch: TreeBatch, profiles: MeasuredProfiles, waits_s: Array, closed: bool) -> tuple[Array, float]:
    """The waits in which motors hold, shape (M, 2) [s], and the energy of the others, in which they do not [J]."""
    if not batch.robot.standby:
        return waits_s, 0.0
    time = standing(waits_s, closed)
    power = np.append(profiles.idle_w[:, 0], profiles.idle_w[-1, 1])[: len(time)]
    least_j = standing_energy_j(batch.robot.standby, power, time)
    holds = least_j >= power * time
    held = waits_s.copy()
    held[:, 0] *= holds[: len(held)]
    after = np.append(holds[1:], holds[0] if closed else True)[: len(held)]
    held[:, 1] *= after
    return held, float(least_j[~holds].sum())


def believed(run: CycleRun, profiles: MeasuredProfiles, robot: Robot, tree: OperationTree) -> CycleRun:
    """A simulated cycle of a tree with durations, energies and idle powers of measured profiles instead of its own."""
    durations, energies = profiles.at(run.speed_limits)
    steps_j = run.energy_j - float(run.vertex_energies_j.sum())
    vertex_j = energies + profiles.idle_w[:, 0] * run.prior_waits_s + profiles.idle_w[:, 1] * run.post_waits_s
    saved_j = 0.0
    if robot.standby:
        before, after = profiles.idle_w[:, 0], profiles.idle_w[:, 1]
        standing_j, saved_j = standing_energies_j(robot, tree, run.prior_waits_s, run.post_waits_s, before, after)
        vertex_j = energies + standing_j
    return replace(
        run,
        standby_saving_j=saved_j,
        durations_s=durations,
        vertex_energies_j=vertex_j,
        energy_j=float(vertex_j.sum()) + steps_j,
        cycle_time_s=float((run.prior_waits_s + durations + run.post_waits_s).sum()),
    )


def learnt_batch(batch: TreeBatch, profiles: MeasuredProfiles) -> TreeBatch:
    """The same trees by the controller that the runs have shown."""
    robot = batch.robot.variant(controller=profiles.controller)
    return TreeBatch(robot, batch.trees, batch.slowest_speed_limit)


def _within(batch: TreeBatch, profiles: MeasuredProfiles) -> Mask:
    """Speed limits that a batch allows, shape (M, S)."""
    lowest, highest = (limit[:, None] for limit in batch.speed_range)
    limits = profiles.speed_limits
    return np.asarray((limits >= lowest - 1e-9) & (limits <= highest + 1e-9), dtype=np.bool_)


def check_measured(batch: TreeBatch, runs: MeasuredRuns, moves: Sequence[int]) -> None:
    """Refuse runs that leave out some moves of the one tree, or know one of them at a single speed limit.

    Raises:
        InputError: They do; names the move.
    """
    names = [vertex.name for vertex in batch.graphs[0].vertices]
    for move in moves:
        speeds = np.unique(runs.speed_limits[runs.motion == move]).size
        if speeds < 2:
            found = "has no run" if speeds == 0 else "was measured at one speed limit only"
            raise InputError(
                f"move '{names[move]}' {found}",
                file=runs.source,
                key="move",
                allowed="runs of every move at two speed limits or more, or profiles 'predicted'",
            )
