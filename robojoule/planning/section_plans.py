"""Plans of cycles with waits or motions of unknown length: section by section, each for its own share of time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from robojoule.errors import InputError
from robojoule.formats.program import Program
from robojoule.inputs import counted
from robojoule.planning.cycle_run import OPEN_CYCLE, CycleRun
from robojoule.planning.plan import Plan
from robojoule.programs.operation_tree import PLANNED
from robojoule.programs.sections import sections_of, shared_groups, unknown_operations
from robojoule.progress import within

_MOST_NAMED = 6  # places that a message names


def has_sections(program: Program) -> bool:
    """Whether nobody knows how long some part of a program takes."""
    return bool(unknown_operations(program.tree))


def refuse_sections(program: Program, what: str) -> None:
    """Refuse a program of which nobody knows how long some part takes, for what needs the whole cycle.

    Raises:
        InputError: It has such parts; names them.
    """
    if has_sections(program):
        problem = f"{what} needs the whole cycle, and nobody knows how long {unknown_places(program)} takes"
        raise InputError(problem, file=program.path, allowed="durations of these waits (--wait LINE=SECONDS)")


def unknown_places(program: Program) -> str:
    """Where a program's parts of unknown length are, for messages."""
    keys = {operation.name: key for key, operation in program.tree.walk()}
    names = [one.name for one in unknown_operations(program.tree)]
    places = [program.places.get(f"{keys[name]}.target_rad", f"operation '{name}'") for name in names]
    found = list(dict.fromkeys(places))
    more = f" and {len(found) - _MOST_NAMED} more" if len(found) > _MOST_NAMED else ""
    return ", ".join(found[:_MOST_NAMED]) + more


def section_programs(program: Program) -> tuple[Program, ...]:
    """The sections of a program as programs of their own.

    Raises:
        InputError: It has none: nothing moves but parts of unknown length; names them.
    """
    found = tuple(replace(program, tree=section) for section in sections_of(program.tree))
    if not found:
        problem = f"no motion stands apart from the parts of unknown length: {unknown_places(program)}"
        raise InputError(problem, file=program.path, allowed="durations of these parts (--wait LINE=SECONDS)")
    return found


def plan_in_sections(program: Program, cycle_time: object, plan_one: Callable[[Program], Plan]) -> Plan:
    """One plan of all sections of a program.

    Args:
        program: The program.
        cycle_time: What was asked for: a share above the time that each section takes as given.
        plan_one: The plan of one section.

    Raises:
        InputError: The cycle time is in seconds, or see `section_programs` and `optimize`.
    """
    if not (isinstance(cycle_time, str) and cycle_time.strip().endswith("%")):
        problem = f"nobody knows how long {unknown_places(program)} takes, so a cycle time in seconds says nothing"
        raise InputError(
            problem, file=program.path, key="cycle_time", allowed="a share (+10%), or durations of these waits"
        )
    sections = section_programs(program)
    plans = []
    for number, section in enumerate(sections, 1):
        with within(f"section {number} of {len(sections)}"):
            plans.append(plan_one(section))
    return _joined(program, plans)


def simulated_sections(program: Program, runs: Sequence[CycleRun]) -> CycleRun:
    """The run of a program from those of its sections, with everything to know about it."""
    return replace(joined_runs(runs), warnings=_joined_warnings(program, runs))


def joined_runs(runs: Sequence[CycleRun]) -> CycleRun:
    """Runs of sections, one after the other; the root mean square of torques is an upper bound."""
    times = np.array([run.cycle_time_s for run in runs])
    squares = np.array([run.rms_torque_ratio**2 for run in runs])
    whole_s = float(times.sum())
    arrays = ["speed_limits", "durations_s", "prior_waits_s", "post_waits_s"]
    arrays += ["vertex_energies_j", "peak_powers_w", "peak_torque_ratios"]
    joined: dict[str, Any] = {name: np.concatenate([getattr(run, name) for run in runs]) for name in arrays}
    return replace(
        runs[-1],
        names=tuple(name for run in runs for name in run.names),
        through=tuple(names for run in runs for names in run.through or ((),) * len(run.names)),
        rms_torque_ratio=math.sqrt(float(squares @ times) / whole_s) if whole_s > 0.0 else 0.0,
        energy_j=sum(run.energy_j for run in runs),
        cycle_time_s=whole_s,
        peak_power_w=max(run.peak_power_w for run in runs),
        standby_saving_j=sum(run.standby_saving_j for run in runs),
        **joined,
    )


def _joined_warnings(program: Program, parts: Sequence[CycleRun] | Sequence[Plan]) -> tuple[str, ...]:
    """What to know about all sections, each sentence once; that a section does not close goes without saying."""
    known = dict.fromkeys(text for part in parts for text in part.warnings if text != OPEN_CYCLE)
    where, sections = unknown_places(program), counted(len(parts), "section")
    groups = sorted(shared_groups(program.tree))
    shared = [f"speed group '{name}' has moves in several sections: its speed is kept" for name in groups]
    return (*known, *shared, f"time and energy are those of {sections}: how long {where} takes is not known")


def _joined(program: Program, plans: Sequence[Plan]) -> Plan:
    settings: dict[str, Mapping[str, float]] = {}
    keys = [key for key in PLANNED if key != "most_speed_percent"]  # of plans that a trial may follow: not in sections
    for plan in plans:
        settings |= {move.name: {key: getattr(move, key) for key in keys} for move in plan.program.moves}
    figures = (
        "least_cycle_time_s",
        "energy_given_j",
        "energy_unoptimized_j",
        "bound_j",
        "reserve_s",
        "standby_given_j",
    )
    return replace(
        plans[-1],
        program=replace(program, tree=program.tree.with_settings(settings)),
        run=joined_runs([plan.run for plan in plans]),
        warnings=_joined_warnings(program, plans),
        outlook=None,
        **{name: sum(getattr(plan, name) for plan in plans) for name in (*figures, "standby_given_j")},
    )
