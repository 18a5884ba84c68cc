"""Flows with next to nothing to do, over the start of Prefect's server alone. `python -m benchmarks.starts`.

The server is Prefect's own command on a store that is there, from nothing to its first answer: what each of these flows
cannot do without. Those that compute in other processes also load Prefect in each of them: `loading` is one such load.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks import pipeline
from benchmarks.measure import interleaved, ratio, rounded, run
from flows.service import answers, free_port

ROUNDS = 3
PATIENCE_S = 600.0
# One shard for each of two workers, all but free of work.
SCALE = ("flows.scale", "--motions", "20", "--shard-motions", "10", "--workers", "2")


def start_server(store: Path) -> None:
    """Start Prefect's server, wait for its first answer, and end it.

    Raises:
        RuntimeError: It does not answer.
    """
    port = free_port()
    command = [sys.executable, "-m", "prefect", "server", "start", "--host", "127.0.0.1", "--port", str(port)]
    store_url = f"sqlite+aiosqlite:///{store}"
    process = subprocess.Popen(
        command,
        env={**os.environ, "PREFECT_SERVER_DATABASE_CONNECTION_URL": store_url},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    end = time.monotonic() + PATIENCE_S
    try:
        while not answers(f"http://127.0.0.1:{port}/api/health"):
            if process.poll() is not None or time.monotonic() > end:
                raise RuntimeError("Prefect's server did not answer")
            time.sleep(0.05)
    finally:
        process.kill()
        process.wait()


def measure(folder: Path, rounds: int = ROUNDS) -> dict[str, float]:
    """Seconds of the works, one after another in each round, and their ratios; the machine's load beside them."""
    sets = iter(range(rounds + 1))
    works: dict[str, Any] = {
        "server": lambda: start_server(folder / "prefect.db"),
        "loading": lambda: run([sys.executable, "-c", "from prefect import flow, task"]),
        "scale": lambda: run([sys.executable, "-m", *SCALE, "--out", str(folder / f"set-{next(sets)}")]),
    }
    # Only where nothing is out of date: a benchmark must not reproduce the pipeline in the user's folder.
    status = run([sys.executable, "-m", "dvc", "status", "--json", "dvc.yaml"]).output
    if shutil.which("make") and json.loads(status) == {}:
        works["flow"] = lambda: run(["make", "flow"])
    load = os.getloadavg()[0]
    seconds = interleaved(rounds, **works)
    return rounded(
        {
            **{f"{name}_over_server": ratio(seconds, name, "server") for name in works if name in ("scale", "flow")},
            **{f"{name}_s": median(values) for name, values in seconds.items()},
            "load": load,
        }
    )


def main() -> None:
    """Print the figures as JSON."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.starts", description=__doc__.splitlines()[0])
    parser.add_argument(
        "--rounds", type=int, default=ROUNDS, metavar="N", help=f"rounds that count (default: {ROUNDS})"
    )
    parser.add_argument("--pipeline", action="store_true", help="the whole pipeline over bare writing and fits, too")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = measure(Path(folder), arguments.rounds)
        print(json.dumps(found | (pipeline.measure(Path(folder)) if arguments.pipeline else {})))


if __name__ == "__main__":
    main()
