"""Arguments that several commands share, and what they mean."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from robojoule.cli._controller import beside_of, check_beside
from robojoule.documents import check_output
from robojoule.errors import InputError, require_package
from robojoule.inputs import as_path, number_of, shown

if TYPE_CHECKING:
    from robojoule.arrays import Array
    from robojoule.formats.program import Program
    from robojoule.planning.pareto import TradeOff
    from robojoule.planning.plan import Plan
    from robojoule.robots.robot import Robot
    from robojoule.year import Operation

_MOST_DIGITS = 10


def add_program(parser: argparse.ArgumentParser, *, needed: bool = True) -> None:
    """Add the program."""
    parser.add_argument(
        "program",
        type=Path,
        nargs=None if needed else "?",
        metavar="PROGRAM",
        help="operation tree (YAML, JSON), joint positions (CSV), or a program in a robot's own language "
        "(KUKA .src, FANUC .ls, ABB .mod, UR .script)",
    )
    add_angles(parser, "as the file says, else model; of the pendant in a robot's own language")
    frame = "X,Y,Z[,RX,RY,RZ] in mm and degrees, turned about the fixed axes x, y, z"
    parser.add_argument(
        "--tool", type=numbers, metavar="FRAME", help=f"tool on the flange, where the program does not say it: {frame}"
    )
    parser.add_argument(
        "--base", type=numbers, metavar="FRAME", help="base (user frame), where the program does not say it, likewise"
    )
    parser.add_argument(
        "--wait",
        action="append",
        default=[],
        metavar="LINE=S",
        help="how long the program waits in a line for something that comes [s]; may be repeated",
    )
    parser.add_argument(
        "--controller-data", metavar="FILE", help="tools, bases, payloads and waits in one file (YAML, JSON)"
    )


def add_angles(parser: argparse.ArgumentParser, of: str) -> None:
    """Add --angles."""
    parser.add_argument(
        "--angles",
        choices=("model", "pendant"),
        help=f"whether joint angles are those of the robot's model or as its pendant shows them (default: {of})",
    )


@overload
def program_and_robot_of(arguments: argparse.Namespace) -> tuple[Program, Robot]: ...
@overload
def program_and_robot_of(arguments: argparse.Namespace, *, needs_robot: bool) -> tuple[Program, Robot | None]: ...
def program_and_robot_of(
    arguments: argparse.Namespace, *, needs_robot: bool = True
) -> tuple[Program, Robot] | tuple[Program, Robot | None]:
    """The program that the arguments name, as the robot executes it that they or it name; none only if not needed."""
    from robojoule.formats.program import load_program

    check_beside(arguments, arguments.program)
    program = load_program(arguments.program, beside=beside_of(arguments))
    if arguments.angles is not None:
        program = program.counted_as(arguments.angles)
    if not needs_robot and arguments.robot is None and program.robot is None:
        return program, None
    robot = robot_of(arguments, program)
    return program.for_robot(robot), robot


def add_robot(parser: argparse.ArgumentParser, *, named_by_program: bool = False) -> None:
    """Add --robot and the payload's arguments."""
    said = " (default: the one that the program names)" if named_by_program else ""
    parser.add_argument(
        "--robot", required=not named_by_program, metavar="NAME", help=f"catalog name, robot file or URDF{said}"
    )
    parser.add_argument(
        "--payload",
        type=number,
        default=0.0,
        metavar="KG",
        help="payload mass [kg] (default: 0, nothing is carried)",
    )
    parser.add_argument(
        "--payload-com",
        type=number,
        nargs=3,
        default=(0.0, 0.0, 0.1),
        metavar=("X", "Y", "Z"),
        help="payload's centre of mass in the tool frame [m] (default: 0 0 0.1)",
    )
    parser.add_argument(
        "--payload-inertia",
        type=numbers,
        metavar="XX,YY,ZZ[,XY,XZ,YZ]",
        help="payload's inertia about its centre of mass in tool axes [kg m2] (default: an aluminium sphere)",
    )


def add_slowest(parser: argparse.ArgumentParser) -> None:
    """Add --slowest-speed-limit."""
    parser.add_argument(
        "--slowest-speed-limit",
        type=number,
        default=1.0,
        metavar="PERCENT",
        help="least speed limit of a motion; energies are least within this bound (default: 1; the thesis: 10)",
    )


def add_speed_step(parser: argparse.ArgumentParser) -> None:
    """Add --speed-step."""
    parser.add_argument(
        "--speed-step",
        type=number,
        default=None,
        metavar="PERCENT",
        help="step of speed limits that the controller takes [%%] (default: 1; in RAPID and URScript, 0.1)",
    )


def add_measurements(parser: argparse.ArgumentParser) -> None:
    """Add the reserve, measured runs and caution."""
    parser.add_argument(
        "--reserve",
        default="0",
        metavar="S",
        help="slack kept at the end: seconds (0.1s) or a share of the cycle (1%%)",
    )
    add_runs(parser)


def add_runs(parser: argparse.ArgumentParser, *, with_caution: bool = True) -> None:
    """Add measured runs, and caution."""
    parser.add_argument(
        "--runs",
        metavar="FILE",
        help="measured runs of the moves: CSV or Parquet with move, speed_limit_percent, duration_s and, if known, "
        "energy_j",
    )
    if not with_caution:
        return
    parser.add_argument(
        "--cautious",
        action="store_true",
        help="plan by the upper end of the interval of predicted or measured energies",
    )


def add_profiles(parser: argparse.ArgumentParser) -> None:
    """Add where energy profiles come from."""
    parser.add_argument(
        "--profiles",
        metavar="KIND",
        help="where energies come from: simulated (default), predicted, measured (default with --runs)",
    )


def add_model(parser: argparse.ArgumentParser) -> None:
    """Add which predictor gives predicted profiles."""
    parser.add_argument(
        "--model",
        metavar="MODEL",
        help="predictor of profiles: a folder, or models:/NAME@ALIAS in MLflow's registry "
        "(default: the one that comes with the robot)",
    )


def add_bounds(parser: argparse.ArgumentParser) -> None:
    """Add what a plan must keep beside its cycle time."""
    parser.add_argument(
        "--peak-power", type=number, metavar="W", help="largest mains power that the cycle may draw [W] (default: any)"
    )
    parser.add_argument(
        "--allow-overload",
        type=number,
        default=0.0,
        metavar="PERCENT",
        help="by how much torques may exceed the robot's peak limits [%%] (default: 0)",
    )


def add_year(parser: argparse.ArgumentParser) -> None:
    """Add how much the robot works in a year, and what its electricity costs."""
    group = parser.add_argument_group("what it means in a year")
    group.add_argument("--shifts", type=number, default=2.0, metavar="N", help="shifts of 8 h a day (default: 2)")
    group.add_argument("--days", type=number, default=250.0, metavar="N", help="working days a year (default: 250)")
    group.add_argument("--country", default="DEU", metavar="CODE", help="for CO2: DEU, CZE, USA .. (default: DEU)")
    group.add_argument("--price", type=number, metavar="EUR", help="of a kWh (default: 0.20, the EU's industry)")
    group.add_argument("--co2", type=number, metavar="G", help="CO2 of a kWh [g] (default: that of the country)")


def operation_of(arguments: argparse.Namespace) -> Operation:
    """How much the robot works in a year, as the arguments say."""
    from robojoule.year import Operation

    return Operation.of(
        shifts=arguments.shifts,
        days=arguments.days,
        country=arguments.country,
        price_per_kwh=arguments.price,
        co2_g_per_kwh=arguments.co2,
    )


def save_plan(plan: Plan, path: Path, robot: Robot) -> tuple[str, ...]:
    """Write a program with its plan, in another format if the suffix names one, and say what that cannot say."""
    from robojoule.formats.conversion import converted
    from robojoule.formats.registry import format_of
    from robojoule.formats.vendor.files import VendorFiles

    found = format_of(path)
    if isinstance(found, VendorFiles) and found.name != plan.program.format:
        return converted(plan.program, path, robot).lost
    plan.save(path)
    return ()


def add_diff(parser: argparse.ArgumentParser) -> None:
    """Add --diff."""
    parser.add_argument(
        "--diff", action="store_true", help="show what changes in the program's files, as a unified diff"
    )


def trade_off_of(arguments: argparse.Namespace, program: Program, robot: Robot, model: Path | None) -> TradeOff:
    """Energy over cycle time by what `optimize` and `pareto` are both asked for."""
    from robojoule.api import pareto

    return pareto(
        program,
        robot,
        model=model,
        runs=arguments.runs,
        cautious=arguments.cautious,
        **choices_of(arguments),
    )


def choices_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """Among what `optimize` and `pareto` both choose, by the names of the library's arguments."""
    return {
        "allow_faster": arguments.allow_faster,
        "slowest_speed_limit_percent": arguments.slowest_speed_limit,
        "profiles": arguments.profiles,
    }


def wishes_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """What `optimize` and `adjust` are both asked for, by the names of the library's arguments."""
    return {
        "cycle_time": arguments.cycle_time,
        "speed_step": arguments.speed_step,
        "reserve": arguments.reserve,
        "runs": arguments.runs,
        "cautious": arguments.cautious,
        "peak_power_w": arguments.peak_power,
        "allow_overload_percent": arguments.allow_overload,
    }


def robot_of(arguments: argparse.Namespace, program: Program | None = None) -> Robot:
    """The robot that the arguments name, or else the program, with its payload."""
    from robojoule.robots import load_robot
    from robojoule.robots.robot import Payload

    name = arguments.robot if arguments.robot is not None or program is None else program.robot
    if name is None:
        raise InputError("the program does not say which robot it is for", key="--robot", allowed="a robot's name")
    payload = Payload(arguments.payload, tuple(arguments.payload_com), arguments.payload_inertia)
    return load_robot(name, payload)


def joints_of(degrees: Sequence[float], robot: Robot, where: str, angles: str | None = None) -> Array:
    """Joint positions in degrees, of the model or as the pendant shows them, as radians of the model.

    Raises:
        InputError: Not a configuration of this robot.
    """
    import numpy as np

    positions = np.radians(degrees)
    if angles == "pendant" and positions.shape == (robot.joint_count,):
        from robojoule.robots.pendant import PendantAngles

        positions = PendantAngles.of(robot).model_rad(positions)
    return robot.check_configuration(positions, where)


def numbers(text: str) -> list[float]:
    """Numbers, separated by commas."""
    try:
        return [number_of(part.strip()) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{shown(text)} is not a list of numbers, separated by commas") from None


def number(text: str) -> float:
    """One number."""
    try:
        return number_of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def whole_number(text: str) -> int:
    """One number without a fraction."""
    if not (text.isascii() and text.removeprefix("-").isdigit() and len(text) < _MOST_DIGITS):
        raise argparse.ArgumentTypeError(f"{shown(text)} is not a whole number")
    return int(text)


def check_outputs(arguments: argparse.Namespace, inputs: Sequence[str], outputs: Mapping[str, Sequence[str]]) -> None:
    """Refuse files to write before any work is done, unless all of them can be written and nothing else is lost.

    Args:
        arguments: Parsed arguments.
        inputs: Names of those that are files to read; the controller's data always are.
        outputs: Names of those that are files to write, with the suffixes that each may have.

    Raises:
        InputError: A wrong suffix, a missing folder or package, a file that is read or written by another argument, or
            one that is there and would be replaced unasked.
    """
    all_read = [*inputs, *(name for name in ("controller_data",) if hasattr(arguments, name))]
    read = {name: [as_path(path, name)] for name in all_read if (path := getattr(arguments, name)) is not None}
    if read.get("robot", [Path()])[0].suffix.lower() == ".urdf":  # its drive file is read, too
        from robojoule.robots.urdf import DRIVE_FILE_SUFFIXES

        read["robot"] += [read["robot"][0].with_suffix(suffix) for suffix in DRIVE_FILE_SUFFIXES]
    taken = [(path, f"the {name.replace('_', ' ')}") for name, paths in read.items() for path in paths]
    for name, suffixes in outputs.items():
        if (text := getattr(arguments, name)) is None:
            continue
        path, option = as_path(text, f"--{name}"), f"--{name}"
        if path.suffix.lower() not in suffixes:
            raise InputError(f"unknown file type {shown(path.suffix)}", key=option, allowed=", ".join(suffixes))
        check_output(path, option)
        _check_companions(path, option)
        for other, what in taken:
            if _is_same(path, other):
                raise InputError(f"this is {what} itself", file=path, key=option, allowed="another file")
        taken.append((path, f"the file of {option}"))
        if name == "plot":
            require_package("matplotlib", "plot", option)


def _check_companions(path: Path, option: str) -> None:
    """Refuse a program to write with which another file that is there would be replaced."""
    from robojoule.formats.registry import FORMATS
    from robojoule.formats.vendor.files import VendorFiles

    for found in FORMATS:
        if isinstance(found, VendorFiles) and path.suffix.lower() in found.suffixes:
            found.check_companions(path, found.companions, option)


def _is_same(path: Path, other: Path) -> bool:
    try:
        return path.samefile(other)
    except (OSError, ValueError):  # one of them does not exist
        return os.path.normcase(os.path.realpath(path)) == os.path.normcase(os.path.realpath(other))
