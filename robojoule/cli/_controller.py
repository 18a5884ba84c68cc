"""What stands in the controller, as options of commands give it beside a program."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from robojoule.errors import InputError

if TYPE_CHECKING:
    from robojoule.formats.vendor.trace import Beside
    from robojoule.robots.rigid_body import Placement


def check_beside(arguments: argparse.Namespace, path: Path | None) -> None:
    """Refuse what stands in the controller, unless it goes with a program in a robot's own language.

    Raises:
        InputError: There is another program, or none; names the option.
    """
    from robojoule.formats.program import NOT_BESIDE
    from robojoule.formats.registry import format_of
    from robojoule.formats.vendor.files import VendorFiles

    options = {name: getattr(arguments, name) for name in ("tool", "base", "wait", "controller_data")}
    given = [f"--{name.replace('_', '-')}" for name, value in options.items() if value not in (None, [])]
    if given and (path is None or not isinstance(format_of(path), VendorFiles)):
        raise InputError(NOT_BESIDE, file=path, key=given[0], allowed="KUKA .src, FANUC .ls, ABB .mod, UR .script")


def beside_of(arguments: argparse.Namespace) -> Beside:
    """What is given beside a program's file; options overrule the file of the controller's data."""
    from robojoule.formats.vendor.controller_data import frame, read_controller_data, wait_of
    from robojoule.formats.vendor.trace import Beside

    beside = Beside() if arguments.controller_data is None else read_controller_data(arguments.controller_data)
    frames: dict[str, Placement | None] = {"tool": None, "base": None}
    for name in frames:
        if (given := getattr(arguments, name)) is not None:
            try:
                frames[name] = frame(*given)
            except InputError as error:
                raise InputError(error.problem, key=f"--{name}", allowed=error.allowed) from None
    try:
        waits = dict(wait_of(text) for text in arguments.wait)
    except InputError as error:
        raise InputError(error.problem, key="--wait", allowed=error.allowed) from None
    return replace(beside, waits_s={**beside.waits_s, **waits}, tool=frames["tool"], base=frames["base"])
