"""`robojoule example`: programs and scripts to start from."""

from __future__ import annotations

import argparse
from importlib import resources
from pathlib import Path
from typing import Any

from robojoule.documents import write_text
from robojoule.errors import InputError

ABOUT = {
    "cycle.yaml": "a pick-and-place cycle as an operation tree",
    "positions.csv": "the moves of the same cycle as a table of joint positions",
    "cell.yaml": "a cell of three robots, with hand-overs and shared space",
    "robot_cell.yaml": "three robots of the catalog round a table, with their programs",
    "six_robots.yaml": "six robots of the catalog round two tables",
    "plan_cell.py": "plans cell.yaml and shows what each robot saves by it",
    "save_energy.py": "plans cycle.yaml for a tenth more time and writes slower.yaml",
    "choose_cycle_time.py": "prints what longer cycle times of cycle.yaml save",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which example, and where to."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="example to write; without it they are listed")
    parser.add_argument("--out", type=Path, metavar="FILE", help="where to (default: NAME, in this folder)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """List the examples, or write one where there is no such file yet."""
    name, out = arguments.name, arguments.out
    if name is None:
        if out is not None:
            raise InputError("no example is named", key="--out", allowed=f"with one of {', '.join(ABOUT)}")
        return {"examples": ABOUT, "out": None}
    if name not in ABOUT:
        raise InputError(f"unknown example '{name}'", allowed=", ".join(ABOUT))
    out = Path(name) if out is None else out
    if out.exists():
        raise InputError("the file exists already", file=out, allowed="a new file, named by --out")
    write_text(out, resources.files("robojoule").joinpath("examples", name).read_text(encoding="utf-8"))
    return {"examples": {name: ABOUT[name]}, "out": str(out)}


def show(result: dict[str, Any]) -> None:
    """Print the list, or what was written."""
    if result["out"]:
        print(f"written to {result['out']}")
        return
    width = max(map(len, result["examples"]))
    for name, about in result["examples"].items():
        print(f"{name:{width}}  {about}")
