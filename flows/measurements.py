"""Logs of a machine taken in: checked, its figures identified, its motions added to the measured set, and learnt from.

`python -m flows.measurements FILE ...` puts logs into the inbox, as copying them does. The watch on it (`flows.inbox`)
tells the server, whose trigger starts the flow, and a schedule looks into it as well. Data and the files by which DVC
knows them go to the branch `measurements`.
"""

from __future__ import annotations

import argparse
import filecmp
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path

import pyarrow as pa
from prefect import flow, get_run_logger
from prefect.artifacts import create_table_artifact

from flows.clone import scratch_clone
from flows.command import told
from flows.inbox import INBOX, SUFFIXES, whole_logs
from reproduction.config import RobotParams, load_params
from reproduction.layout import Layout
from reproduction.measured.motions import measured_motions, read_measured
from reproduction.measured.predictor import predictor_of
from reproduction.tables import write_parquet
from reproduction.tracking.measured import record_measured
from reproduction.tracking.store import MEASURED, RecordError, connect
from robojoule.calibration.log import read_log
from robojoule.documents import atomic_path, write_document, write_text
from robojoule.errors import InputError
from robojoule.profile.predictor_file import save_profile_predictor
from robojoule.robots.robot import Robot

BRANCH = "measurements"
IDENTITY = ("-c", "user.name=ingest-measurements", "-c", "user.email=ingest@localhost")
_FOLDER_NAME = re.compile(r"\w[\w.-]*")


@dataclass(frozen=True)
class MeasuredFolder:
    """Files of one robot on the branch: motions of another one teach nothing about it."""

    clone: Path
    robot: str

    @property
    def runs(self) -> Path:
        """The measured set."""
        return self._below("runs.parquet")

    @property
    def logs(self) -> Path:
        """The logs that it is made from."""
        return self._below("logs")

    @property
    def predictor(self) -> Path:
        """What it teaches."""
        return self._below("energy_profile")

    def identified(self, log: str) -> Path:
        """The robot file with the figures that a log gave."""
        return self._below("identified") / f"{log}.json"

    @property
    def kept_by_dvc(self) -> list[str]:
        """Those that DVC keeps, by their names in the clone."""
        return [path.relative_to(self.clone).as_posix() for path in (self.runs, self.logs, self.predictor)]

    def _below(self, name: str) -> Path:
        return self.clone / "measured" / self.robot / name


@flow(name="ingest-measurements", persist_result=False)
def ingest_measurements(
    inbox: Path = INBOX, robot: str | None = None, payload_kg: float | None = None, root: Path = Path()
) -> dict[str, str]:
    """Take in the logs of an inbox.

    Args:
        inbox: Folder in which they are; read logs go to `accepted` or `rejected` below it.
        robot: Name of the robot in the catalog; that of `params.yaml` if not given.
        payload_kg: What it carried where a log does not say it; that of `params.yaml` if not given. [kg]
        root: Folder of the project.

    Returns:
        Log -> "accepted", or why it was rejected.

    Raises:
        InputError: Bad robot, the record or the clone cannot be had, or the branch is checked out somewhere.
        RecordError: The logs are taken in, but the training is not recorded.
    """
    logger, layout = get_run_logger(), Layout(root.resolve())
    logs = whole_logs(layout.root / inbox)
    if not logs:
        return {}
    machine = _machine(load_params(layout.root / "params.yaml").robot, robot, payload_kg)
    _check_branch(layout.root)
    mlflow = connect(layout, MEASURED)
    outcome: dict[str, str] = {}
    unrecorded: RecordError | None = None
    with scratch_clone(layout.root) as clone:
        git, dvc = _tool(clone, "git"), _tool(clone, sys.executable, "-m", "dvc")
        measured = MeasuredFolder(clone, machine.name)
        known = before = _open_branch(measured, git, dvc, machine)
        for path in logs:
            try:
                known = _taken(path, machine, known, measured)
                outcome[path.name] = "accepted"
            except InputError as error:
                outcome[path.name] = str(error)
            logger.info("%s: %s", path.name, outcome[path.name])
        if known is not None and known is not before:
            write_parquet(measured.runs, known)
            try:
                found = predictor_of(machine, known)
            except InputError as error:
                logger.info("nothing is learnt yet: %s", error)
            else:
                save_profile_predictor(found.predictor, measured.predictor)
                try:
                    logger.info(record_measured(mlflow, layout, found, measured.predictor, measured.runs))
                except RecordError as error:  # told when the logs are safe
                    unrecorded = error
            dvc("add", "--quiet", *(one for one in measured.kept_by_dvc if (clone / one).exists()))
            git("add", "measured")
            git("commit", "--quiet", "-m", f"Measured: {', '.join(k for k, v in outcome.items() if v == 'accepted')}")
            git("push", "--quiet", "origin", f"HEAD:refs/heads/{BRANCH}")
    for path in logs:  # when the branch has them
        _file(path, outcome[path.name])
    create_table_artifact(
        key="measurements",
        table=[{"log": name, "outcome": said} for name, said in outcome.items()],
        description="Logs that were taken in",
    )
    if unrecorded is not None:
        raise unrecorded
    return outcome


def _machine(params: RobotParams, robot: str | None, payload_kg: float | None) -> Robot:
    """The robot that was measured, with what the parameters say of its payload."""
    chosen = params if robot is None else params.model_copy(update={"name": robot})
    machine = chosen.robot(payload_kg)
    if not _FOLDER_NAME.fullmatch(machine.name):
        raise InputError(f"the robot's name '{machine.name}' names no folder", allowed="letters, digits, '_', '-', '.'")
    return machine


def _check_branch(root: Path) -> None:
    """Refuse to work where Git will not let the result be pushed: into a folder whose files it would have to change."""
    words = ["git", "worktree", "list", "--porcelain"]
    said = subprocess.run(words, cwd=root, capture_output=True, text=True, check=False)
    folder = ""
    for line in said.stdout.splitlines():  # where there is no Git, the clone says so
        kind, _, value = line.partition(" ")
        folder = value if kind == "worktree" else folder
        if (kind, value) == ("branch", f"refs/heads/{BRANCH}"):
            raise InputError(
                f"the branch {BRANCH} is checked out here, so that nothing can be added to it",
                file=folder,
                allowed="another branch in this folder",
            )


def _open_branch(
    measured: MeasuredFolder, git: Callable[..., None], dvc: Callable[..., None], machine: Robot
) -> pa.Table | None:
    """Check the branch out, or begin it; returns the robot's measured set so far."""
    try:
        git("checkout", "--quiet", BRANCH)
    except InputError:
        git("checkout", "--quiet", "-b", BRANCH)
    files = [f"{one}.dvc" for one in measured.kept_by_dvc if (measured.clone / f"{one}.dvc").exists()]
    if not files:
        return None
    dvc("checkout", "--quiet", *files)
    return read_measured(measured.runs, machine.joint_count)


def _taken(path: Path, machine: Robot, known: pa.Table | None, measured: MeasuredFolder) -> pa.Table:
    """The measured set with a log's motions; its figures and the log itself are put into the clone.

    The set as it is for a log that is in it: a run that was killed before it moved the log took it in.

    Raises:
        InputError: Why it is rejected.
    """
    from robojoule.api import identify  # brings scipy

    if known is not None and path.name in known["log"].to_pylist():
        if filecmp.cmp(path, measured.logs / path.name, shallow=False):
            return known
        raise InputError("another log of this name was taken in before", file=path.name)
    log = read_log(path, machine)
    found = identify(log, machine)
    if found.payload_that_fits_kg is not None:
        raise InputError(
            f"it looks like a payload of about {found.payload_that_fits_kg:.1f} kg, not {machine.payload.mass_kg:g} kg",
            file=path.name,
        )
    if found.held_out.rmse_w >= found.held_out_catalog.rmse_w:
        raise InputError("what was identified explains held-out motions no better than the catalog", file=path.name)
    rows = measured_motions(log, machine)
    write_document(measured.identified(path.name), found.robot_file().model_dump(mode="json"))
    measured.logs.mkdir(parents=True, exist_ok=True)
    shutil.copy(path, measured.logs / path.name)
    return rows if known is None else pa.concat_tables([known.select(rows.column_names), rows])


def _file(path: Path, said: str) -> None:
    """Move a log to the accepted ones, or to the rejected ones with the reason beside it; none is overwritten."""
    folder = path.parent / ("accepted" if said == "accepted" else "rejected")
    folder.mkdir(exist_ok=True)
    target = _free(folder, path.name)
    if said != "accepted":
        write_text(target.with_name(f"{target.name}.reason.txt"), said + "\n")
    path.replace(target)


def _free(folder: Path, name: str) -> Path:
    """A name in a folder that no file has: the given one, else with a number behind its stem."""
    stem, dot, rest = name.partition(".")
    numbered = (f"{stem}-{number}{dot}{rest}" for number in count(2))
    return next(folder / one for one in chain([name], numbered) if not (folder / one).exists())


def _tool(folder: Path, *command: str) -> Callable[..., None]:
    """A command line tool in a folder."""
    identity = IDENTITY if command == ("git",) else ()

    def run(*words: str) -> None:
        done = subprocess.run([*command, *identity, *words], cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            lines = [line.strip() for line in done.stderr.splitlines() if line.strip()] or ["no output"]
            problem = next((line for line in lines if line.startswith("!")), lines[-1])  # git's reason for a refusal
            raise InputError(f"{Path(command[-1]).name} {words[0]} failed ({problem})", file=folder)

    return run


def main() -> None:
    """Put logs into the inbox, whole or not at all."""
    parser = argparse.ArgumentParser(prog="python -m flows.measurements", description=__doc__.splitlines()[0])
    parser.add_argument("logs", type=Path, nargs="+", metavar="FILE", help="logs of the machine")
    parser.add_argument("--inbox", type=Path, default=INBOX, help=f"folder (default: {INBOX})")
    arguments = parser.parse_args()
    with told("flows.measurements"):
        for log in arguments.logs:
            if not log.is_file() or log.suffix.lower() not in SUFFIXES or log.name.startswith("."):
                allowed = f"a file ending with {', '.join(SUFFIXES)}, and no dot before its name"
                raise InputError("this is not a log", file=log, allowed=allowed)
            if (arguments.inbox / log.name).exists():
                raise InputError("a log of this name waits there", file=arguments.inbox, allowed="another name")
            with atomic_path(arguments.inbox / log.name) as path:
                shutil.copyfile(log, path)
            print(f"{log.name} is in {arguments.inbox}")


if __name__ == "__main__":
    main()
