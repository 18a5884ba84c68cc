"""`robojoule profile`: the energy profile of one point-to-point motion, or of one move of a program."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from robojoule.cli._arguments import (
    add_model,
    add_profiles,
    add_program,
    add_robot,
    add_runs,
    check_outputs,
    joints_of,
    numbers,
    program_and_robot_of,
    robot_of,
    whole_number,
)
from robojoule.cli._controller import check_beside
from robojoule.cli._models import model_folder
from robojoule.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from robojoule.profile.energy_profile import EnergyProfile


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Robot, both ends or a move of a program, and the speed limits."""
    add_program(parser, needed=False)
    add_robot(parser, named_by_program=True)
    parser.add_argument("--move", metavar="NAME", help="the move of PROGRAM that is meant, instead of --from and --to")
    for option, name, which in (("--from", "start", "start"), ("--to", "end", "end")):
        parser.add_argument(
            option, dest=name, type=numbers, metavar="DEG", help=f"{which} joints, comma-separated [deg]"
        )
    parser.add_argument(
        "--points", type=whole_number, default=19, metavar="N", help="speed limits from 10 to 100 %% (default: 19)"
    )
    add_profiles(parser)
    add_model(parser)
    add_runs(parser, with_caution=False)
    parser.add_argument("--plot", metavar="FILE", help="draw where the energy goes over the duration (.svg)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Find the profile, and draw it if asked for."""
    check_outputs(arguments, ["program", "robot", "runs"], {"plot": [".svg"]})
    with model_folder(arguments.model) as model:
        profile = _profile(arguments, model)
    if arguments.plot:
        from robojoule.documents import write_text
        from robojoule.plots.energy import drawing_of

        if not profile.parts_j:
            problem = f"{profile.profiles} profiles do not say where the energy goes"
            raise InputError(problem, key="--plot", allowed="simulated profiles")
        write_text(arguments.plot, drawing_of(profile))
    return profile.to_dict()


def _profile(arguments: argparse.Namespace, model: Path | None) -> EnergyProfile:
    from robojoule.api import energy_profile

    settings = {"points": arguments.points, "profiles": arguments.profiles, "model": model}
    if arguments.program is not None:
        for option, value in (("--from", arguments.start), ("--to", arguments.end)):
            if value is not None:
                raise InputError("a move of a program has its ends", key=option, allowed="--move alone")
        program, robot = program_and_robot_of(arguments)
        return energy_profile(robot, program=program, move=arguments.move, runs=arguments.runs, **settings)
    check_beside(arguments, None)
    for option, value in (("--move", arguments.move), ("--runs", arguments.runs)):
        if value is not None:
            raise InputError("this needs the program whose moves are meant", key=option, allowed="PROGRAM before it")
    for option, value in (("--robot", arguments.robot), ("--from", arguments.start), ("--to", arguments.end)):
        if value is None:
            raise InputError("this is missing", key=option, allowed="--robot, --from and --to, or a PROGRAM")
    robot = robot_of(arguments)
    start, end = (
        joints_of(joints, robot, option, arguments.angles)
        for joints, option in ((arguments.start, "--from"), (arguments.end, "--to"))
    )
    return energy_profile(robot, start, end, **settings)


def show(result: dict[str, Any]) -> None:
    """Print the profile as a table."""
    by = f", {result['profiles']} profile" if result["profiles"] != "simulated" else ""
    rule = f" ({result['rule']})" if result["rule"] else ""
    print(f"{result['robot']}, payload {result['payload_kg']:g} kg{by}{rule}")
    durations = _with_interval(result, "duration", "s", 4, 12)
    energies = _with_interval(result, "energy", "j", 1, 10)
    print(f"speed limit [%]{durations[0]}{energies[0]}")
    for row, limit in enumerate(result["speed_limit_percent"]):
        mark = "  measured" if limit in result["measured_speed_limit_percent"] else ""
        mark += "  optimum" if limit == result["optimal_speed_limit_percent"] else ""
        print(f"{limit:15.1f}{durations[row + 1]}{energies[row + 1]}{mark}")
    print(f"saving at the optimum: {result['energy_saving_j']:.1f} J against full speed")
    print(
        f"idle power: {result['idle_power_start_w']:.1f} W at the start, {result['idle_power_end_w']:.1f} W at the end"
    )
    for warning in result["warnings"]:
        print(f"warning: {warning}")


def _with_interval(result: dict[str, Any], name: str, unit: str, digits: int, width: int) -> list[str]:
    """Header and cells of a column, with the interval where there is one."""
    values, low, high = (result[f"{key}_{unit}"] for key in (name, f"{name}_low", f"{name}_high"))
    shown = f"[{unit.upper() if unit == 'j' else unit}]"
    cells = [f"  {name} {shown}", *(f"  {value:{width}.{digits}f}" for value in values)]
    if low is None:
        return cells
    ends = [f"{first:{width - 1}.{digits}f}{last:{width - 2}.{digits}f}" for first, last in zip(low, high, strict=True)]
    heads = f"90 % interval {shown}"
    return [text + end.rjust(len(heads) + 2) for text, end in zip(cells, [heads, *ends], strict=True)]
