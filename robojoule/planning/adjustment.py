"""Plan again from what one cycle of a plan took on the machine, where nothing else was measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.formats.program import Program
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun, simulate_trees
from robojoule.planning.cycle_time import cycle_time_s, reserve_s
from robojoule.planning.optimization import RELATIVE_GAP, Wish, profile_source, required_s
from robojoule.planning.plan import Plan, plan_of, plan_warnings
from robojoule.planning.schedule import CYCLE_TIME_TOLERANCE_S
from robojoule.planning.source_plans import plan_on_source
from robojoule.planning.whole_speeds import Pace, whole_speed_plan
from robojoule.planning.writeback import write_plan
from robojoule.programs.operation_tree import OperationTree

MOST_FACTOR = 3.0  # by which motions may last longer, or shorter, than simulated


def adjusted(program: Program, batch: TreeBatch, full_speed: OperationTree, measured_s: float, wish: Wish) -> Plan:
    """A plan made again from what one cycle of it took on the machine.

    All motions are taken to last longer, or shorter, by the same share: that of the time the machine moved over the
    time it should have moved, waits being as written.

    Args:
        program: The program with the plan that ran.
        batch: Its tree with all speed limits free.
        full_speed: The tree at full speed.
        measured_s: Cycle time that was measured. [s]
        wish: What the new plan shall be like; its cycle time is that of the machine.
    """
    ran, fastest = simulate_trees(batch, [[program.tree, full_speed]])[0]
    moved_s = float(ran.durations_s.sum())
    waited_s = ran.cycle_time_s - moved_s
    if not waited_s < measured_s:
        problem = f"the measured cycle of {measured_s:.6g} s is shorter than the program's waits"
        raise InputError(problem, key="measured_cycle", allowed=f"more than {waited_s:.6g} s")
    factor = (measured_s - waited_s) / moved_s
    if not 1.0 / MOST_FACTOR <= factor <= MOST_FACTOR:
        raise InputError(
            f"the measured cycle of {measured_s:.6g} s makes motions {factor:.3g} times as long as simulated",
            key="measured_cycle",
            allowed=f"{1.0 / MOST_FACTOR:.2g} to {MOST_FACTOR:g} times; check robot, payload and program",
        )
    steps_s = required_s(batch)
    least_s = steps_s + factor * (float(batch.least_cycles_s[0]) - steps_s)
    as_ran, at_full = (scaled(run, factor, batch.idle_post_w) for run in (ran, fastest))
    # Where the power bounds the speeds, faster moves do not help.
    faster_s = at_full.cycle_time_s if wish.peak_power_w is None else None
    wanted_s = cycle_time_s(wish.cycle_time, given_s=as_ran.cycle_time_s, least_s=least_s, faster_s=faster_s)
    kept_s = reserve_s(wish.reserve, wanted_s)
    if wanted_s - kept_s < least_s - CYCLE_TIME_TOLERANCE_S:
        raise CycleTimeTooShort(wanted_s, least_s + kept_s, None if faster_s is None else faster_s + kept_s)
    source = profile_source(batch, wish)
    asked_s = max(steps_s + (wanted_s - kept_s - steps_s) / factor, float(batch.least_cycles_s[0]))
    schedule = plan_on_source(source, batch, np.array([[asked_s]]), relative_gap=RELATIVE_GAP).plans[0][0]
    pace = Pace(factor, wanted_s - kept_s)
    whole = whole_speed_plan(source, batch, schedule, step_percent=wish.step_percent, reserve_s=kept_s, machine=pace)
    tree, graph, timed = batch.trees[0], batch.graphs[0], whole.schedule
    written = write_plan(tree, graph, timed, whole.speed_limits, timed.durations_s, program.wait_step_s)
    written = program.placed(written)
    run = scaled(simulate_trees(batch, [[written]])[0][0], factor, batch.idle_post_w)
    bound_j = timed.bound_j - max(timed.cycle_time_s - run.cycle_time_s, 0.0) * float(batch.idle_post_w.max())
    return plan_of(
        program,
        batch,
        written,
        (run, as_ran, at_full),
        float(batch.idle_post_w[-1]),
        least_cycle_time_s=least_s,
        bound_j=min(bound_j, run.energy_j),
        warnings=(
            *plan_warnings(written, run, as_ran),
            f"motions take {factor:.4f} times their simulated durations, all alike: a table of runs tells more",
        ),
        reserve_s=kept_s,
        profiles=wish.profiles,
    )


def scaled(run: CycleRun, factor: float, idle_w: Array) -> CycleRun:
    """A simulated cycle whose motions last longer by a factor [-], the time more being drawn at idle power (M,) [W]."""
    longer_j = (factor - 1.0) * run.durations_s * idle_w
    durations = factor * run.durations_s
    return replace(
        run,
        durations_s=durations,
        vertex_energies_j=run.vertex_energies_j + longer_j,
        energy_j=run.energy_j + float(longer_j.sum()),
        cycle_time_s=float((run.prior_waits_s + durations + run.post_waits_s).sum()),
    )
