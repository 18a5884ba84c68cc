"""Start-up of commands, in processes of their own. `python -m benchmarks.commands`."""

from __future__ import annotations

import json
import shutil
import sys
from statistics import median

from benchmarks.measure import interleaved, ratio, rounded, run

PROFILE = "profile --robot kuka_kr16_r2010_2 --payload 10 --from 0,-90,90,0,0,0 --to 45,-60,70,0,30,0"
PACKAGES = "import numpy, pydantic, yaml"  # all that `profile` loads beside robojoule; it does not load Pinocchio
ROUNDS = 7


def measure() -> dict[str, float]:
    """`robojoule profile` against bare imports of what it needs; `make repro` against `dvc repro`."""
    command = [sys.executable, "-m", "robojoule"]
    seconds = interleaved(
        ROUNDS,
        imports=lambda: run([sys.executable, "-c", PACKAGES]),
        help=lambda: run([*command, "--help"]),
        profile=lambda: run([*command, *PROFILE.split()]),
    )
    result = {
        "profile_over_imports": ratio(seconds, "profile", "imports"),
        "help_s": median(seconds["help"]),
        "profile_s": median(seconds["profile"]),
        "imports_s": median(seconds["imports"]),
    }
    dvc = [sys.executable, "-m", "dvc"]
    # Only where nothing is out of date: a benchmark must not reproduce the pipeline in the user's folder.
    if shutil.which("make") and json.loads(run([*dvc, "status", "--json"]).output) == {}:
        nothing = interleaved(3, make=lambda: run(["make", "repro"]), dvc=lambda: run([*dvc, "repro"]))
        result |= {
            "noop_make_over_dvc_repro": ratio(nothing, "make", "dvc"),
            "noop_make_repro_s": median(nothing["make"]),
        }
    return rounded(result)


if __name__ == "__main__":
    print(json.dumps(measure()))
