"""The command line: `robojoule COMMAND ...`.

Each command is a module of this package with `add_arguments(parser)`, `run(arguments) -> dict` and `show(result)`. The
dictionary is what `--json` prints; `show` prints it for people. A module is imported only when its command runs.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from importlib import import_module

from robojoule import __version__

COMMANDS = {
    "example": "write a program or a script to start from",
    "robots": "list the robots of the catalog",
    "profile": "energy over duration of one motion",
    "simulate": "cycle time, energy, largest power and torque of a program as it stands",
    "optimize": "speed limits and waits with the least energy for a cycle time",
    "pareto": "least energy over cycle time, and what a second of cycle time is worth",
    "identify": "drive parameters from a measured log of motions and mains power",
}


def _parser(command: str | None) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="robojoule", description="Less energy for robots at the same cycle time.")
    parser.add_argument("--version", action="version", version=f"robojoule {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, text in COMMANDS.items():
        sub = commands.add_parser(name, help=text, description=text[:1].upper() + text[1:] + ".")
        sub.add_argument("--json", action="store_true", help="print one JSON object instead of text")
        if name == command:
            import_module(f"robojoule.cli.{name}").add_arguments(sub)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        Exit code: 0 done, 1 failed, 2 bad input.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    command = next((word for word in words if word in COMMANDS), None)
    parsed = _parser(command).parse_args(words)
    from robojoule.errors import InputError, RobojouleError

    module = import_module(f"robojoule.cli.{parsed.command}")
    try:
        result = module.run(parsed)
    except InputError as error:
        if error.key and error.file is None and error.key in vars(parsed):  # said as it was typed
            error = InputError(error.problem, key=f"--{error.key.replace('_', '-')}", allowed=error.allowed)
        print(f"robojoule {parsed.command}: {error}", file=sys.stderr)
        return 2
    except RobojouleError as error:
        print(f"robojoule {parsed.command}: {error}", file=sys.stderr)
        return 1
    try:
        if parsed.json:
            print(json.dumps(result, allow_nan=False))
        else:
            module.show(result)
        sys.stdout.flush()
    except BrokenPipeError:  # the reader, such as `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or the interpreter's own flush would fail
        return 1
    return 0
