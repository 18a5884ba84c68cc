"""What robojoule does, one function each: they take programs, robots and logs and give typed results.

Units are SI; every result has `to_dict()`, plain data that is ready for JSON. Bad input raises
`robojoule.errors.InputError` with one sentence.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from robojoule.calls import also_cells, finite, in_sections
from robojoule.checks import (
    SLOWEST_PERCENT,
    adjustable_tree,
    check_trial,
    checked_batch,
    checked_kind,
    checked_runs,
    checked_step,
    known_program,
    model_program,
    moving_batch,
)
from robojoule.errors import InputError
from robojoule.formats.program import Program
from robojoule.identifying import identify as identify
from robojoule.identifying import identify_friction as identify_friction
from robojoule.identifying import identify_timing as identify_timing
from robojoule.inputs import LONGEST_S, as_flag, as_number
from robojoule.page.report import Report, report_of
from robojoule.planning.adjustment import adjusted
from robojoule.planning.cycle_run import CycleRun, cycle_warnings, simulate_trees
from robojoule.planning.guard import Guard
from robojoule.planning.learnt_timing import with_learnt_timing
from robojoule.planning.optimization import Profiles, Wish, checked_profiles, planned, planned_on_runs, trade_off
from robojoule.planning.pareto import TradeOff
from robojoule.planning.path_checks import collision_warnings
from robojoule.planning.plan import Plan, faster_warnings
from robojoule.planning.section_plans import has_sections, refuse_sections, section_programs, simulated_sections
from robojoule.profile.predicted import ProfilePredictor
from robojoule.profile.predictor_file import load_profile_predictor
from robojoule.profiling import energy_profile as energy_profile
from robojoule.progress import Listener, telling
from robojoule.robots.robot import Robot
from robojoule.year import Operation, yearly

if TYPE_CHECKING:
    from robojoule.calibration.run_table import MeasuredRuns


@also_cells
@finite
@in_sections
def optimize(
    program: Program,
    robot: Robot,
    *,
    cycle_time: float | str,
    allow_faster: bool = False,
    speed_step: float | None = None,
    reserve: float | str = 0.0,
    profiles: Profiles | None = None,
    model: str | Path | None = None,
    runs: str | Path | MeasuredRuns | None = None,
    cautious: bool = False,
    peak_power_w: float | None = None,
    allow_overload_percent: float = 0.0,
    slowest_speed_limit_percent: float = SLOWEST_PERCENT,
    progress: Listener | None = None,
) -> Plan:
    """The plan with the least energy for a cycle time: speed limits and waits of the program.

    The program's waits and process steps are kept, its speed limits are upper bounds, those of fixed moves are kept.
    Waits that an earlier plan added (`added_wait_after_s`) may go again, so a plan that is planned again for its own
    cycle time stays as it is.

    A `Cell` may be given instead of program and robot: `optimize(cell, time_limit_s=60)`, with the settings of
    `robojoule.planning.cells.solve.solve_cell`, gives its `CellPlan`. A `RobotCell`, robots with their programs, gives
    a `RobotCellPlan`, see `robojoule.planning.robot_cells.solve.plan_robot_cell`.

    Args:
        program: What the robot does in a cycle.
        robot: Robot with its payload.
        cycle_time: Seconds (7.5), or a share above the cycle time of the program as given, all its waits and its speed
            limits included ("+10%"). Where nobody knows how long a part takes, a share, which each section between
            such parts keeps.
        allow_faster: Whether moves that are not fixed may be faster than the program's speed limits.
        speed_step: Step of speed limits that the controller takes; a given speed limit may stay as it is. If not given,
            whole percents, or a tenth where the program's language has speeds or durations. [%]
        reserve: Slack that is kept as a wait at the end of the cycle: seconds (0.1), or a share of it ("1%").
        profiles: Where energies and durations come from: simulated (the default without runs), predicted, or measured
            (the default with runs: of every move, at two speed limits or more).
        model: Folder of a trained predictor (`predictor.json`, `predictor.npz`) for predicted profiles, which are the
            default then; else the one that comes with the robot.
        runs: Measured runs of the program's moves, as a table (see `robojoule.calibration.run_table`) or as read. With
            simulated profiles they tell the controller's timing alone.
        cautious: Whether to plan by the upper quantile of energy differences; for predicted and measured profiles.
        peak_power_w: Largest mains power that the cycle may draw, by simulation; any if not given. [W]
        allow_overload_percent: By how much torques may exceed the peak limits. [%]
        slowest_speed_limit_percent: Least speed limit of a plan's motions, 0.01 to 100. The optimum is that within
            this bound (the thesis's is 10). [%]
        progress: Hears how far the work is, see `robojoule.progress`.

    Raises:
        InputError: The program does not fit the robot, an argument or a run is not valid, a joint torque exceeds its
            peak limit, or the largest power cannot be kept.
        CycleTimeTooShort: The cycle time is shorter than the fastest cycle; names the least feasible one.
        PlanningError: The solver failed.
    """
    step_percent, guard = checked_step(speed_step, program), Guard.of(peak_power_w, allow_overload_percent)
    as_given = known_program(program, robot)
    program = model_program(as_given, robot)
    at_full_speed = program.tree.without_plan(full_speed=True)
    tree = at_full_speed if as_flag(allow_faster, "allow_faster") else None
    batch = moving_batch(program, guard.bearing(robot), tree, slowest_speed_limit_percent)  # motions and graph
    source = checked_profiles(profiles, with_runs=runs is not None, cautious=cautious, with_model=model is not None)
    wish = Wish(cycle_time, reserve, step_percent, source, cautious, guard.peak_power_w, _predictor(model))
    known = None if runs is None else checked_runs(runs, program)
    doubts: tuple[str, ...] = ()
    if known is not None and source == "simulated":
        batch, doubts = with_learnt_timing(batch, known)
    batch = guard.bounded(batch)
    with telling(progress):
        if known is None or source == "simulated":
            plan = planned(program, batch, at_full_speed, wish)
            plan = replace(plan, warnings=(*plan.warnings, *doubts))
        else:
            plan = planned_on_runs(program, batch, known, wish)
    return guard.told(plan, as_given, robot)


@finite
def adjust(
    program: Program,
    robot: Robot,
    *,
    measured_cycle: float | None = None,
    runs: str | Path | MeasuredRuns | None = None,
    cycle_time: float | str | None = None,
    given: Program | None = None,
    allow_faster: bool = False,
    speed_step: float | None = None,
    reserve: float | str = 0.0,
    cautious: bool = False,
    model: str | Path | None = None,
    peak_power_w: float | None = None,
    allow_overload_percent: float = 0.0,
) -> Plan:
    """A plan made again from what a trial of it took on the machine.

    Speed limits of the plan do not bound the new one: they are what the last plan chose. Those of the program before it
    do, which plans saved as YAML or JSON say (`most_speed_percent`). Fixed moves keep theirs.

    Args:
        program: The plan that ran: the program with its speed limits and waits.
        robot: Robot with its payload, as for the plan.
        measured_cycle: What the cycle took. All motions are taken to be longer, or shorter, by the same share. [s]
        runs: Or measured runs of the moves, those of earlier trials first: they tell motion by motion.
        cycle_time: Cycle time that is asked for; if not given, the one that the program was planned for, which plans
            say in the program (`planned_cycle_s`). [s]
        given: The program that the plan was made from, whose speed limits are upper bounds; for formats that cannot say
            what they were.
        allow_faster: Whether moves that are not fixed may be faster than the program's own speed limits.
        speed_step: See `optimize`. [%]
        reserve: See `optimize`.
        cautious: See `optimize`.
        model: See `optimize`; it goes with a measured cycle.
        peak_power_w: See `optimize`. [W]
        allow_overload_percent: See `optimize`. [%]

    Raises:
        InputError: Neither or both of cycle and runs are given, or see `optimize`.
        CycleTimeTooShort: The machine cannot keep the cycle time; names the least feasible one.
    """
    check_trial(measured_cycle, runs)
    step_percent, guard = checked_step(speed_step, program), Guard.of(peak_power_w, allow_overload_percent)
    as_given = known_program(program, robot)
    refuse_sections(as_given, "adjust")
    program = model_program(as_given, robot)
    full_speed = program.tree.without_plan(full_speed=True)
    bounds = full_speed if as_flag(allow_faster, "allow_faster") else adjustable_tree(program, given, robot)
    batch = guard.bounded(moving_batch(program, guard.bearing(robot), bounds))
    asked = program.tree.planned_cycle_s if cycle_time is None else cycle_time
    if asked is None:
        problem = "the program does not say for which cycle time it was planned"
        raise InputError(problem, key="cycle_time", allowed="seconds (7.5); plans saved as YAML or JSON say it")
    source = checked_profiles(None, with_runs=runs is not None, cautious=cautious, with_model=model is not None)
    wish = Wish(asked, reserve, step_percent, source, cautious, guard.peak_power_w, _predictor(model))
    if runs is not None:
        plan = planned_on_runs(program, batch, checked_runs(runs, program), wish)
    else:
        measured_s = as_number(measured_cycle, "measured_cycle", least=1e-3, most=LONGEST_S, unit="s")
        plan = adjusted(program, batch, full_speed, measured_s, wish)
    if not (program.remembers or given is not None or allow_faster):
        plan = replace(plan, warnings=(*plan.warnings, *faster_warnings(program.tree, plan.program.tree)))
    return guard.told(plan, as_given, robot, program.tree.planned_cycle_s if cycle_time is None else None)


@finite
def simulate(program: Program, robot: Robot) -> CycleRun:
    """One cycle of a program as it stands: cycle time, energy and largest power and torque, move by move.

    `warnings` tell torques beyond a limit, paths on which the arm touches itself, its base or the floor, and doubts
    about the robot.

    Args:
        program: What the robot does in a cycle.
        robot: Robot with its payload.

    Raises:
        InputError: The program does not fit the robot.
    """
    as_given = known_program(program, robot)
    if has_sections(as_given):
        return simulated_sections(as_given, [simulate(section, robot) for section in section_programs(as_given)])
    program = model_program(as_given, robot)
    run = simulate_trees(checked_batch(program, robot), [[program.tree]])[0][0]
    known = (*as_given.warnings_for(robot), *collision_warnings(program.tree, robot))
    return replace(run, warnings=(*known, *cycle_warnings(program.tree, run)))


@finite
def pareto(
    program: Program,
    robot: Robot,
    *,
    allow_faster: bool = False,
    profiles: Profiles | None = None,
    model: str | Path | None = None,
    runs: str | Path | MeasuredRuns | None = None,
    cautious: bool = False,
    slowest_speed_limit_percent: float = SLOWEST_PERCENT,
    progress: Listener | None = None,
) -> TradeOff:
    """Least energy of a program over its cycle time, for all cycle times at once.

    Args:
        program: What the robot does in a cycle; its speed limits are upper bounds.
        robot: Robot with its payload.
        allow_faster: Whether moves that are not fixed may be faster than the program's speed limits.
        profiles: Where energies and durations come from; see `optimize`.
        model: Folder of a trained predictor; see `optimize`.
        runs: Measured runs of the program's moves; see `optimize`.
        cautious: Whether to go by the upper quantile of energy differences; not for simulated profiles.
        slowest_speed_limit_percent: Least speed limit of the motions, 0.01 to 100. [%]
        progress: See `optimize`.

    Raises:
        InputError: The program does not fit the robot, or the bound or a run is not valid.
    """
    as_given = known_program(program, robot)
    refuse_sections(as_given, "a trade-off")
    program = model_program(as_given, robot)
    faster = program.tree.without_plan(full_speed=True) if as_flag(allow_faster, "allow_faster") else None
    batch = moving_batch(program, robot, faster, slowest_speed_limit_percent)
    fastest = simulate_trees(batch, [[batch.trees[0].without_plan()]])[0][0]
    known = (*as_given.warnings_for(robot), *collision_warnings(program.tree, robot))
    source = checked_profiles(profiles, with_runs=runs is not None, cautious=cautious, with_model=model is not None)
    measured, predictor = None if runs is None else checked_runs(runs, program), _predictor(model)
    with telling(progress):
        found = trade_off(batch, source, measured, cautious=cautious, predictor=predictor)
    return replace(found, fastest=fastest, warnings=(*known, *cycle_warnings(batch.trees[0], fastest), *found.warnings))


@finite
def report(
    plan: Plan,
    program: Program,
    robot: Robot,
    *,
    trade_off: TradeOff | None = None,
    operation: Operation | None = None,
    progress: Listener | None = None,
) -> Report:
    """A plan beside the program as given, with what it means in a year; `save` writes a page to look at.

    Args:
        plan: Plan of the program; see `optimize`.
        program: The program as given.
        robot: Robot with its payload, as for the plan.
        trade_off: Energy over cycle time of the program, if it is not the one that `pareto` gives of itself.
        operation: How much the robot works in a year, and what its electricity costs; see `robojoule.year`.
        progress: See `optimize`.

    Raises:
        InputError: The plan is not one of this program.
    """
    plan = checked_kind(plan, Plan, "a plan", "plan", "what optimize returns")
    if trade_off is not None:
        trade_off = checked_kind(trade_off, TradeOff, "a trade-off", "trade_off", "what pareto returns")
    if operation is not None:
        operation = checked_kind(operation, Operation, "an operation", "operation", "what Operation.of returns")
    program = known_program(program, robot)
    refuse_sections(program, "a page")
    if [move.name for move in plan.program.moves] != [move.name for move in program.moves]:
        raise InputError(f"the plan is one of '{plan.program.name}', not of '{program.name}'", key="plan")
    curve = pareto(program, robot, progress=progress) if trade_off is None else trade_off
    tree, planned = (model_program(one, robot).tree for one in (program, plan.program))
    batch = checked_batch(model_program(program, robot), robot)
    given = simulate_trees(batch, [[tree]])[0][0]
    year = yearly(plan.cycle_time_s, plan.energy_given_j, plan.energy_j, operation or Operation.of())
    with telling(progress):
        return report_of(plan, curve, (tree, given), planned, batch, year)


def _predictor(model: str | Path | None) -> ProfilePredictor | None:
    return None if model is None else load_profile_predictor(model)
