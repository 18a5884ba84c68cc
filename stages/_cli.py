"""The command line that every stage shares."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from reproduction.config import Params, load_params
from robojoule.errors import InputError, RobojouleError
from stages.layout import Layout


def run(stage: Callable[[Params, Layout], None]) -> None:
    """Run `stage` on the folder and parameter file named on the command line; bad input ends with exit code 2."""
    parser = argparse.ArgumentParser(prog=f"python -m stages.{stage.__name__}", description=stage.__doc__)
    parser.add_argument("--root", type=Path, default=Path(), help="folder of data/, models/ and reports/ (default: .)")
    parser.add_argument("--params", type=Path, default=None, help="parameter file (default: ROOT/params.yaml)")
    arguments = parser.parse_args()
    try:
        stage(load_params(arguments.params or arguments.root / "params.yaml"), Layout(arguments.root))
    except InputError as error:
        print(f"{stage.__name__}: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    except RobojouleError as error:
        print(f"{stage.__name__}: {error}", file=sys.stderr)
        raise SystemExit(1) from None
