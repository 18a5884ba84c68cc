"""`robojoule convert`: a program in another format, and what that format cannot say."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from robojoule.cli._arguments import add_program, add_robot, check_outputs, program_and_robot_of
from robojoule.inputs import counted


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Program, output and robot."""
    add_program(parser)
    parser.add_argument("out", type=Path, metavar="OUT", help="file to write; its suffix says the format")
    add_robot(parser, named_by_program=True)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Read, write, and say what is lost."""
    from robojoule.formats.conversion import converted
    from robojoule.formats.registry import FORMATS

    suffixes = [suffix for one in FORMATS for suffix in one.suffixes]
    check_outputs(arguments, ["program", "robot"], {"out": suffixes})
    program, robot = program_and_robot_of(arguments, needs_robot=False)
    made = converted(program, arguments.out, robot)
    return {
        "program": program.name,
        "out": str(made.path),
        "files": [str(path) for path in made.files],
        "format": made.format,
        "moves": made.moves,
        "lost": list(made.lost),
    }


def show(result: dict[str, Any]) -> None:
    """Print what was written, and to the error output what the format cannot say."""
    print(f"{counted(result['moves'], 'move')} written to {' and '.join(result['files'])} ({result['format']})")
    for text in result["lost"]:
        print(f"not in the new file as it was: {text}", file=sys.stderr)
