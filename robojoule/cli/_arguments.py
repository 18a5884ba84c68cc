"""Arguments that several commands share, and what they mean."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from robojoule.documents import check_output
from robojoule.errors import InputError, require_package
from robojoule.inputs import as_path, number_of, shown

if TYPE_CHECKING:
    from robojoule.arrays import Array
    from robojoule.robots.robot import Robot

_MOST_DIGITS = 10


def add_program(parser: argparse.ArgumentParser) -> None:
    """Add the program."""
    parser.add_argument(
        "program", type=Path, metavar="PROGRAM", help="operation tree (YAML, JSON) or joint positions (CSV)"
    )


def add_robot(parser: argparse.ArgumentParser, *, default: str | None = None) -> None:
    """Add --robot and the payload's arguments."""
    parser.add_argument(
        "--robot", default=default, required=default is None, metavar="NAME", help="catalog name, robot file or URDF"
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


def add_measurements(parser: argparse.ArgumentParser) -> None:
    """Add where profiles come from, and the reserve."""
    parser.add_argument(
        "--reserve",
        default="0",
        metavar="S",
        help="slack kept at the end: seconds (0.1s) or a share of the cycle (1%%)",
    )
    parser.add_argument(
        "--runs",
        metavar="FILE",
        help="measured runs of the moves: CSV or Parquet with move, speed_limit_percent, duration_s and, if known, "
        "energy_j",
    )
    parser.add_argument(
        "--cautious",
        action="store_true",
        help="plan by the upper end of the interval of predicted or measured energies",
    )


def robot_of(arguments: argparse.Namespace) -> Robot:
    """The robot that the arguments name, with its payload."""
    from robojoule.robots import load_robot
    from robojoule.robots.robot import Payload

    return load_robot(arguments.robot, Payload(arguments.payload, tuple(arguments.payload_com)))


def joints_of(degrees: Sequence[float], robot: Robot, where: str) -> Array:
    """Joint positions in degrees as radians.

    Raises:
        InputError: Not a configuration of this robot.
    """
    import numpy as np

    return robot.check_configuration(np.radians(degrees), where)


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
        inputs: Names of those that are files to read.
        outputs: Names of those that are files to write, with the suffixes that each may have.

    Raises:
        InputError: A wrong suffix, a missing folder or package, or a file that is read or written by another argument.
    """
    read = {name: [as_path(path, name)] for name in inputs if (path := getattr(arguments, name)) is not None}
    if read.get("robot", [Path()])[0].suffix.lower() == ".urdf":  # its drive file is read, too
        from robojoule.robots.urdf import DRIVE_FILE_SUFFIXES

        read["robot"] += [read["robot"][0].with_suffix(suffix) for suffix in DRIVE_FILE_SUFFIXES]
    taken = [(path, f"the {name}") for name, paths in read.items() for path in paths]
    for name, suffixes in outputs.items():
        if (text := getattr(arguments, name)) is None:
            continue
        path, option = as_path(text, f"--{name}"), f"--{name}"
        if path.suffix.lower() not in suffixes:
            raise InputError(f"unknown file type {shown(path.suffix)}", key=option, allowed=", ".join(suffixes))
        check_output(path, option)
        for other, what in taken:
            if _is_same(path, other):
                raise InputError(f"this is {what} itself", file=path, key=option, allowed="another file")
        taken.append((path, f"the file of {option}"))
        if name == "plot":
            require_package("matplotlib", "plot", option)


def _is_same(path: Path, other: Path) -> bool:
    try:
        return path.samefile(other)
    except (OSError, ValueError):  # one of them does not exist
        return os.path.normcase(os.path.realpath(path)) == os.path.normcase(os.path.realpath(other))
