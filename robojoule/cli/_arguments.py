"""Arguments that several commands share, and what they mean."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from robojoule.errors import InputError, require_package

if TYPE_CHECKING:
    from robojoule.arrays import Array
    from robojoule.robots.robot import Robot


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
        "--payload", type=float, default=0.0, metavar="KG", help="payload mass [kg] (default: 0, nothing is carried)"
    )
    parser.add_argument(
        "--payload-com",
        type=float,
        nargs=3,
        default=(0.0, 0.0, 0.1),
        metavar=("X", "Y", "Z"),
        help="payload's centre of mass in the tool frame [m] (default: 0 0 0.1)",
    )


def robot_of(arguments: argparse.Namespace) -> Robot:
    """The robot that the arguments name, with its payload."""
    from robojoule.robots import load_robot
    from robojoule.robots.robot import Payload

    return load_robot(arguments.robot, Payload(arguments.payload, tuple(arguments.payload_com)))


def joints_of(text: str, robot: Robot, where: str) -> Array:
    """Joint positions in degrees, separated by commas, as radians.

    Raises:
        InputError: Not numbers, or not a configuration of this robot.
    """
    import numpy as np

    try:
        degrees = [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(
            f"'{text}' is not a list of joint positions", key=where, allowed="degrees, comma-separated"
        ) from None
    return robot.check_configuration(np.radians(degrees), where)


def check_suffix(path: str | Path | None, option: str, *suffixes: str) -> None:
    """Refuse a file to write before any work is done, unless its suffix is one of some.

    Raises:
        InputError: It is another one.
    """
    if path is not None and Path(path).suffix.lower() not in suffixes:
        raise InputError(f"unknown file type '{Path(path).suffix}'", key=option, allowed=", ".join(suffixes))


def check_plot(path: str | Path | None, *suffixes: str) -> None:
    """Refuse a drawing before any work is done, unless it can be made.

    Raises:
        InputError: Unknown suffix, or Matplotlib is not installed.
    """
    if path is not None:
        check_suffix(path, "--plot", *suffixes)
        require_package("matplotlib", "plot", "--plot")
