"""The command line: `robojoule COMMAND ...`.

Each command is a module of this package with `add_arguments(parser)`, `run(arguments) -> dict` and `show(result)`. The
dictionary is what `--json` prints; `show` prints it for people, and `exit_code(result)`, where there is one, says what
to exit with. A module is imported only when its command runs.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import re
import sys
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from importlib import import_module
from typing import NoReturn

from robojoule import __version__
from robojoule.cli._progress import sign_of_life
from robojoule.errors import InputError, RobojouleError

COMMANDS = {
    "example": "write a program or a script to start from",
    "robots": "list the robots of the catalog, check a robot file, scale drives for a URDF",
    "profile": "energy over duration of one motion",
    "convert": "a program in another format, such as a robot's own language",
    "simulate": "cycle time, energy, largest power and torque of a program as it stands",
    "optimize": "speed limits and waits with the least energy for a cycle time",
    "adjust": "a plan made again from what a trial of it took on the machine",
    "pareto": "least energy over cycle time, and what a second of cycle time is worth",
    "identify": "drives and timing of a machine from a log of its motions or a table of its runs",
    "cell": "plans of whole cells: several robots, hand-overs, shared space, power modes",
}
INTERRUPTED = 130  # exit code after Ctrl-C, as of shells


class _Parser(argparse.ArgumentParser):
    """A parser that refuses with one sentence, and takes "-10,20" for a value, not for an option."""

    def __init__(self, *args: object, **settings: object) -> None:
        super().__init__(*args, **settings)  # type: ignore[arg-type]
        self._negative_number_matcher = re.compile(r"-[.\d].*")

    def error(self, message: str) -> NoReturn:
        """Raise what `main` prints."""
        raise InputError(message.removeprefix("argument "))

    def exit(self, status: int = 0, message: str | None = None) -> NoReturn:
        """End after help or version, once they are printed."""
        _flush()
        super().exit(status, message)


def _parser(command: str | None) -> argparse.ArgumentParser:
    parser = _Parser(prog="robojoule", description="Less energy for robots at the same cycle time.")
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
        Exit code: 0 done, 1 failed, 2 bad input, 130 interrupted.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # for terminals that do not know all characters
    words = list(sys.argv[1:] if arguments is None else arguments)
    command = next((word for word in words if not word.startswith("-")), None)
    name = f"robojoule {command}" if command in COMMANDS else "robojoule"
    try:
        return _run(words, command)
    except KeyboardInterrupt:
        return _ended(f"{name}: interrupted", INTERRUPTED)
    except InputError as error:
        return _ended(f"{name}: {error}", 2)
    except RobojouleError as error:
        return _ended(f"{name}: {error}", 1)
    except BrokenPipeError:  # the reader, such as `head`, has seen enough
        return _ended(None, 1)
    except RuntimeError as error:  # Python before 3.12 wraps what happens while a class is made in an import
        if isinstance(error.__cause__, KeyboardInterrupt):
            return _ended(f"{name}: interrupted", INTERRUPTED)
        raise


_WELCOME = """\
Less energy for robots at the same cycle time. For a start:

  robojoule example cycle.yaml     writes a program of a robot; your own (.src, .ls, .mod, .script) does as well
  robojoule optimize cycle.yaml --robot kuka_kr16_r2010_2 --payload 10 --cycle-time +10% \\
      --out slower.yaml --page saving.html
                                   plans it with a tenth more time, writes the plan and a page to look at
  robojoule robots                 lists the robots that are known
  robojoule --help                 says what else there is"""


def _run(words: list[str], command: str | None) -> int:
    if not words:
        print(_WELCOME)
        return 0
    if command is not None and command not in COMMANDS:
        from robojoule.inputs import unknown_name

        raise unknown_name("command", command, COMMANDS)
    parsed = _parser(command).parse_args(words)
    module = import_module(f"robojoule.cli.{parsed.command}")
    try:
        with nullcontext() if getattr(parsed, "quiet", False) else sign_of_life(f"robojoule {parsed.command}"):
            result = module.run(parsed)
    except InputError as error:
        name = re.sub("_(s|w|percent)$", "", error.key or "")  # options leave the unit out
        if error.file is None and name in vars(parsed):  # said as it was typed
            raise InputError(error.problem, key=f"--{name.replace('_', '-')}", allowed=error.allowed) from None
        raise
    try:
        if parsed.json:
            print(json.dumps(result, allow_nan=False))
        else:
            module.show(result)
        _flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        raise RobojouleError(f"the result cannot be printed ({error.strerror})") from None
    code: int = module.exit_code(result) if hasattr(module, "exit_code") else 0
    return code


def _ended(message: str | None, code: int) -> int:
    """The exit code, with a message for people."""
    if message and sys.stderr is not None:
        with suppress(OSError):  # there is no other place to say it
            print(message, file=sys.stderr, flush=True)
    try:
        _flush()
    except OSError:  # or the interpreter's own flush would fail
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return code


def _flush() -> None:
    if sys.stdout is not None:  # as it is where it was closed before the start
        sys.stdout.flush()
