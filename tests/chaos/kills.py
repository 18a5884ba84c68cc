"""Runs of the pipeline that are killed again and again, and what they end with: `python -m tests.chaos.kills --help`.

A chain kills every stage once, at a moment drawn by its seed after the stage began: SIGKILL to all processes of the
run, as from the kernel or a switched-off machine. The same command is given again until it ends by itself.

Every second chain is warm: it starts over the results and stores of other parameters. `--full` takes the project
itself, as committed, and kills each of its three longest stages three times.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
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

from tests.toy import ROOT, make_toy

STAGES = (
    *("generate_trees", "simulate_motions", "build_features", "train_profile_predictor", "train_predictors"),
    *("evaluate_plans", "draw_figures"),
)
COMMAND = '"$0" -m flows.dvc_lock && exec "$0" -m dvc repro "$@"'  # as `make repro` does it
LATEST_S = 4.0  # after a stage began; stages of the small set take 2 to 15 s
LONGEST = ("simulate_motions", "train_predictors", "evaluate_plans")  # at full size
LATEST_FULL_S = 25.0


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
            ["sh", "-c", COMMAND, sys.executable, *words],
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


def kill_in(project: Path, stage: str, after_s: float, log: Path, *words: str) -> Kill:
    """Run the pipeline, or what the words say, until a stage has run for a while, and kill it then."""
    begun: float | None = None
    with running(project, log, *words) as process:
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
    to_the_end(project, folder / f"{seed}-end.log")
    return kills


def to_the_end(project: Path, log: Path, *words: str) -> None:
    """Let a run end by itself.

    Raises:
        AssertionError: It does not end well.
    """
    with running(project, log, *words) as process:
        code = process.wait()
    assert code == 0, log.read_text(encoding="utf-8", errors="replace")[-2000:]


def warm_toy(folder: Path, log: Path) -> Path:
    """The small project with the results, the cache and the record of trees of another seed."""
    project = make_toy(folder)
    params = project / "params.yaml"
    text = params.read_text(encoding="utf-8")
    others = yaml.safe_load(text)
    others["generate_trees"]["seed"] += 1
    params.write_text(yaml.safe_dump(others, sort_keys=False), encoding="utf-8")
    to_the_end(project, log)
    params.write_text(text, encoding="utf-8")
    return project


def kill_at_full_size(seed: int, folder: Path) -> bool:
    """Kill each of the longest stages of the committed project three times, let it end, and hold its outputs' hashes.

    Returns:
        Whether every kill hit its stage, and all hashes are those of the committed lock file.
    """
    project, draw, same = folder / "full", random.Random(seed), True

    def cache(place: Path) -> None:
        (project / ".dvc/config.local").write_text(f"[cache]\n    dir = {place}\n", encoding="utf-8")

    subprocess.run(["git", "clone", "-q", str(ROOT), str(project)], check=True)
    said = subprocess.run([sys.executable, "-m", "dvc", "cache", "dir"], cwd=ROOT, capture_output=True, check=True)
    cache(Path(said.stdout.decode().strip()))
    subprocess.run([sys.executable, "-m", "dvc", "checkout", "--quiet", "dvc.yaml"], cwd=project, check=True)
    cache(project / ".dvc/cache")  # what is killed writes to a cache of its own
    expected = outputs(project)
    for stage in LONGEST:
        words = ("--single-item", "--force", stage)
        moments = [draw.uniform(0.0, LATEST_FULL_S) for _ in range(3)]
        kills = [kill_in(project, stage, after_s, folder / "full.log", *words) for after_s in moments]
        to_the_end(project, folder / "full-end.log", *words)
        wrong = [path for path, found in outputs(project).items() if expected[path] != found] + left_over(project)
        same = same and not wrong and all(kill.hit for kill in kills)
        hit = ", ".join(f"after {kill.after_s:.1f} s" for kill in kills if kill.hit)
        print(f"{stage}: killed {hit or 'never'}: {'the same bytes' if not wrong else f'differs: {wrong}'}", flush=True)
    return same


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
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4], help="of chains of 7 kills each")
    parser.add_argument("--full", action="store_true", help="full size, with the first seed")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="chaos-") as name:
        folder = Path(name)
        if arguments.full:
            raise SystemExit(not kill_at_full_size(arguments.seeds[0], folder))
        undisturbed, warm = make_toy(folder / "undisturbed"), warm_toy(folder / "warm", folder / "warm.log")
        to_the_end(undisturbed, folder / "undisturbed.log")
        expected, differing = outputs(undisturbed), 0
        for place, seed in enumerate(arguments.seeds):
            project, kind = folder / f"seed-{seed}", ("fresh", "warm")[place % 2]
            if kind == "warm":
                shutil.copytree(warm, project, symlinks=True)
            else:
                make_toy(project)
            kills = chain(project, seed, folder)
            found = outputs(project)
            wrong = [path for path in expected | found if expected.get(path) != found.get(path)] + left_over(project)
            differing += bool(wrong)
            hit = ", ".join(f"{kill.stage} after {kill.after_s:.1f} s" for kill in kills if kill.hit)
            said = "the same bytes" if not wrong else f"differs: {wrong}"
            print(f"seed {seed}, {kind}: killed {hit}: {said}", flush=True)
    raise SystemExit(bool(differing))


if __name__ == "__main__":
    main()
