"""Runs of the pipeline that are killed again and again, and what they end with: `python -m tests.chaos.kills --help`.

A chain kills every stage once, at a moment drawn by its seed after the stage began: SIGKILL to all processes of the
run, as from the kernel or a switched-off machine. The same command is given again until it ends by itself.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import yaml

from tests.toy import make_toy

STAGES = (
    *("generate_trees", "simulate_motions", "build_features", "train_profile_predictor", "train_predictors"),
    *("evaluate_plans", "draw_figures"),
)
COMMAND = ("-m", "dvc", "repro")
LATEST_S = 4.0  # after a stage began; stages of the small set take 2 to 15 s


@dataclass(frozen=True)
class Kill:
    """What a kill hit.

    Attributes:
        stage: The stage that ran.
        after_s: How long it had run. [s]
        hit: Whether it still ran: a quick stage may be through.
    """

    stage: str
    after_s: float
    hit: bool


def outputs(project: Path) -> dict[str, str]:
    """Hash of every output of the pipeline, as its lock file has it."""
    lock = yaml.safe_load((project / "dvc.lock").read_text(encoding="utf-8"))
    return {out["path"]: out["md5"] for stage in lock["stages"].values() for out in stage["outs"]}


@contextmanager
def running(project: Path, log: Path, *words: str) -> Iterator[subprocess.Popen[bytes]]:
    """A run of the pipeline in a process group of its own; nothing of it is left afterwards."""
    with log.open("wb") as out:
        process = subprocess.Popen(
            [sys.executable, *COMMAND, *words],
            cwd=project,
            env={**os.environ, "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])},
            stdout=out,
            stderr=out,
            start_new_session=True,
        )
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def kill_in(project: Path, stage: str, after_s: float, log: Path) -> Kill:
    """Run the pipeline until a stage has run for a while, and kill it then."""
    begun: float | None = None
    with running(project, log) as process:
        while process.poll() is None:
            text = log.read_text(encoding="utf-8", errors="replace")
            if begun is None and f"Running stage '{stage}'" in text:
                begun = time.monotonic()
            if begun is not None and time.monotonic() - begun >= after_s:
                return Kill(stage, after_s, "Running stage" not in text.partition(f"Running stage '{stage}'")[2])
            time.sleep(0.05)
    return Kill(stage, after_s, False)


def chain(project: Path, seed: int, folder: Path, latest_s: float = LATEST_S) -> list[Kill]:
    """Kill every stage of a run once, then let it end.

    Args:
        project: A copy of the project; its results, if any, are made again.
        seed: Of the moments.
        folder: Where the output of the runs goes.
        latest_s: How long a stage may run before it is killed. [s]

    Raises:
        AssertionError: The last run does not end well.
    """
    draw = random.Random(seed)
    kills = []
    for stage in STAGES:
        kills.append(kill_in(project, stage, draw.uniform(0.0, latest_s), folder / f"{seed}-{stage}.log"))
    log = folder / f"{seed}-end.log"
    with running(project, log) as process:
        code = process.wait()
    assert code == 0, log.read_text(encoding="utf-8", errors="replace")[-2000:]
    return kills


def left_over(project: Path) -> list[str]:
    """Half-written files and parts that nobody needs any more."""
    return [
        path.relative_to(project).as_posix()
        for folder in ("data", "models", "reports", ".desk/scratch")
        for path in (project / folder).rglob("*")
        if path.is_file() and path.name != ".gitignore" and (path.name.startswith(".") or folder.startswith(".desk"))
    ]


def main() -> None:
    """Several chains, each on a fresh copy of the small project; ends with exit code 1 if one differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.chaos.kills", description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], metavar="N", help="a chain of 7 kills each")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="chaos-") as name:
        folder = Path(name)
        undisturbed = make_toy(folder / "undisturbed")
        with running(undisturbed, folder / "undisturbed.log") as process:
            process.wait()
        expected, differing = outputs(undisturbed), 0
        for seed in arguments.seeds:
            project = make_toy(folder / f"seed-{seed}")
            kills = chain(project, seed, folder)
            found = outputs(project)
            wrong = [path for path in expected | found if expected.get(path) != found.get(path)] + left_over(project)
            differing += bool(wrong)
            hit = ", ".join(f"{kill.stage} after {kill.after_s:.1f} s" for kill in kills if kill.hit)
            print(f"seed {seed}: killed {hit}: {'the same bytes' if not wrong else f'differs: {wrong}'}", flush=True)
    raise SystemExit(bool(differing))


if __name__ == "__main__":
    main()
