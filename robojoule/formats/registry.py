"""The file formats of programs: which there are, and which one a suffix names.

A further format is a module of this package with a `Format` and a line in `FORMATS`; a vendor's language is a package
in `robojoule.formats.vendor` whose parser stands in a line of its own.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robojoule.errors import InputError
from robojoule.formats.format import Format
from robojoule.formats.position_files import PositionFiles
from robojoule.formats.tree_files import TreeFiles
from robojoule.formats.vendor.files import VendorFiles

if TYPE_CHECKING:
    from robojoule.formats.vendor.composing import Composed
    from robojoule.formats.vendor.trace import VendorProgram
    from robojoule.programs.operation_tree import OperationTree
    from robojoule.robots.robot import Robot


def _krl(path: Path) -> VendorProgram:
    from robojoule.formats.vendor.krl.program import read_krl  # late: brings lark

    return read_krl(path)


def _teach_pendant(path: Path) -> VendorProgram:
    from robojoule.formats.vendor.fanuc.program import read_teach_pendant  # late: brings lark

    return read_teach_pendant(path)


def _rapid(path: Path) -> VendorProgram:
    from robojoule.formats.vendor.rapid.program import read_rapid  # late: brings lark

    return read_rapid(path)


def _ur(path: Path) -> VendorProgram:
    from robojoule.formats.vendor.ur.program import read_ur

    return read_ur(path)


def _new_krl(tree: OperationTree, robot: Robot | None, name: str) -> Composed:
    from robojoule.formats.vendor.krl.composing import compose_krl

    return compose_krl(tree, robot, name)


def _new_teach_pendant(tree: OperationTree, robot: Robot | None, name: str) -> Composed:
    from robojoule.formats.vendor.fanuc.composing import compose_teach_pendant

    return compose_teach_pendant(tree, robot, name)


def _new_rapid(tree: OperationTree, robot: Robot | None, name: str) -> Composed:
    from robojoule.formats.vendor.rapid.composing import compose_rapid

    return compose_rapid(tree, robot, name)


def _new_ur(tree: OperationTree, robot: Robot | None, name: str) -> Composed:
    from robojoule.formats.vendor.ur.composing import compose_ur

    return compose_ur(tree, robot, name)


FORMATS: tuple[Format, ...] = (
    TreeFiles(),
    PositionFiles(),
    VendorFiles("KUKA KRL", (".src",), _krl, _new_krl, companions=(".dat",)),
    VendorFiles("FANUC TP", (".ls",), _teach_pendant, _new_teach_pendant),
    VendorFiles("ABB RAPID", (".mod", ".prg"), _rapid, _new_rapid, speed_step_percent=0.1),
    VendorFiles("URScript", (".script",), _ur, _new_ur, speed_step_percent=0.1),
)


def companions_of(path: Path) -> tuple[Path, ...]:
    """Files that go with a program's file, as far as they are there: the .dat of a .src."""
    found = next((one for one in FORMATS if path.suffix.lower() in one.suffixes), None)
    return found.companions_of(path) if isinstance(found, VendorFiles) else ()


def format_of(path: str | Path) -> Format:
    """The format that a file's suffix names.

    Raises:
        InputError: There is no such format; names those that there are.
    """
    suffix = Path(path).suffix.lower()
    for found in FORMATS:
        if suffix in found.suffixes:
            return found
    known = ", ".join(f"{', '.join(one.suffixes)} ({one.name})" for one in FORMATS)
    raise InputError(f"unknown file type '{suffix}'", file=path, allowed=known)
