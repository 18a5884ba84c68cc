"""The command line that every stage shares."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

import stages
from reproduction.layout import Layout
from robojoule.errors import InputError, RobojouleError

Params = TypeVar("Params")
OTHER_BYTES = (
    "this is not Linux on an x86-64 processor with AVX2, so results may differ from the committed ones in their last "
    "digits; `make compare` says where"
)


def run(
    stage: Callable[[Params, Layout], None], load: Callable[[Path], Params], params_file: str = "params.yaml"
) -> None:
    """Run a stage on the folder and the parameter file named on the command line; bad input ends with exit code 2.

    Args:
        stage: The stage.
        load: Reads and validates its parameters.
        params_file: Where they are below the folder of the project.
    """
    parser = argparse.ArgumentParser(prog=f"python -m stages.{stage.__name__}", description=stage.__doc__)
    parser.add_argument("--root", type=Path, default=Path(), help="folder of data/, models/ and reports/ (default: .)")
    parser.add_argument("--params", type=Path, help=f"parameter file (default: ROOT/{params_file})")
    arguments = parser.parse_args()
    if not stages.SAME_BYTES:
        print(f"{stage.__name__}: {OTHER_BYTES}", file=sys.stderr)
    try:
        stage(load(arguments.params or arguments.root / params_file), Layout(arguments.root))
    except RobojouleError as error:
        print(f"{stage.__name__}: {error}", file=sys.stderr)
        raise SystemExit(2 if isinstance(error, InputError) else 1) from None


def say(stage: str) -> Callable[[str], None]:
    """Progress lines of a stage, from whichever of its processes."""
    return partial(_print, stage)


def _print(stage: str, text: str) -> None:
    print(f"{stage}: {text}", flush=True)
