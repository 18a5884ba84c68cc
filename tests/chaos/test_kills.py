"""A chain of kills, short form of `python -m tests.chaos.kills`; what ends a stage early is one sentence."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.chaos.kills import LATEST_S, STAGES, chain, kill_in, left_over, outputs
from tests.conftest import ROOT, run

SEED = 20260828


def test_a_run_whose_every_stage_was_killed_ends_with_the_same_bytes(
    toy_project: Path, reproduced: Path, tmp_path: Path
):
    """From nothing: stores, cache and results are made by runs that are killed."""
    expected = outputs(reproduced)
    hits = 0
    for latest_s in (LATEST_S, 1.0, 0.3):  # a fast machine is through with its stages before the first moments come
        project = tmp_path / f"killed-{latest_s}"
        run("git", "clone", "-q", str(toy_project), str(project), cwd=tmp_path)
        hits += sum(kill.hit for kill in chain(project, SEED, tmp_path, latest_s))
        assert outputs(project) == expected
        assert left_over(project) == []
        if hits >= len(STAGES) - 2:
            break
    assert hits >= len(STAGES) - 2


def test_a_run_over_older_results_that_was_killed_ends_with_the_same_bytes(reproduced: Path, tmp_path: Path):
    """Warm: other results are there, and the store of MLflow."""
    project = tmp_path / "warm"
    shutil.copytree(reproduced, project, symlinks=True)
    shutil.rmtree(project / ".dvc/cache")
    (project / "data/runs.parquet").unlink()
    kills = []
    for stage in ("simulate_motions", "train_predictors"):
        (project / "dvc.lock").unlink(missing_ok=True)
        kills.append(kill_in(project, stage, 1.0, tmp_path / f"{stage}.log"))
    assert any(kill.hit for kill in kills)
    run("dvc", "repro", "train_predictors", cwd=project)
    expected, found = outputs(reproduced), outputs(project)
    assert len(found) > 5 and found == {path: expected[path] for path in found}
    assert left_over(project) == []


def stage(name: str, project: Path, *before: str) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, "-m", f"stages.{name}", "--root", str(project)]
    return subprocess.run([*before, *words], cwd=ROOT, capture_output=True, text=True, check=False)


def small_disk() -> list[str]:
    """Words that give a command a file system of its own of 1 MB at /mnt, where the system allows that."""
    words = ["unshare", "--map-root-user", "--mount", "sh", "-c"]
    if subprocess.run([*words, "mount -t tmpfs tmpfs /mnt"], capture_output=True, check=False).returncode:
        pytest.skip("no file system can be mounted here")
    return words


def test_a_full_disk_is_one_sentence_and_the_same_command_goes_on(reproduced: Path):
    """The data go to a disk of 400 kB, which the time series fill; with room, the stage ends as if nothing had been."""
    words = f"""
mount -t tmpfs -o size=400k tmpfs /mnt && mkdir /mnt/data && cp '{reproduced}/params.yaml' /mnt/ || exit 99
cp '{reproduced}/data/trees.parquet' /mnt/data/
cd '{ROOT}' && {sys.executable} -m stages.simulate_motions --root /mnt; echo "code $?" >&2
find /mnt -name '.*' -type f >&2
mount -o remount,size=50m /mnt && {sys.executable} -m stages.simulate_motions --root /mnt >/dev/null
cmp /mnt/data/runs.parquet '{reproduced}/data/runs.parquet' && echo same >&2
"""
    done = subprocess.run([*small_disk(), words], capture_output=True, text=True, check=False)
    first, *rest = done.stderr.splitlines()
    assert first.startswith("simulate_motions: /mnt/") and "No space left on device" in first, done.stderr
    assert rest == ["code 2", "same"]


@pytest.mark.parametrize("name", ["simulate_motions", "build_features", "train_profile_predictor", "evaluate_plans"])
def test_a_folder_that_cannot_be_written_is_one_sentence(reproduced: Path, name: str):
    words = f"""
mount --bind '{reproduced}' /mnt && mount -o remount,bind,ro /mnt || exit 99
cd '{ROOT}' && {sys.executable} -m stages.{name} --root /mnt >/dev/null; echo "code $?" >&2
"""
    done = subprocess.run([*small_disk(), words], capture_output=True, text=True, check=False)
    first, *rest = done.stderr.splitlines()
    assert first.startswith(f"{name}: /mnt/") and "Read-only file system" in first, done.stderr
    assert rest == ["code 2"]
    assert os.access(reproduced, os.W_OK)
