"""Logs of a machine taken in: checked, its figures identified, its motions added to the measured set, and learnt from.

`python -m flows.measurements FILE ...` puts logs into the inbox, as copying them does. The watch on it (`flows.inbox`)
tells the server, whose trigger starts the flow, and a schedule looks into it as well. Data and the files by which DVC
knows them go to the branch `measurements`.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
from prefect import flow, get_run_logger
from prefect.artifacts import create_table_artifact

from flows.clone import scratch_clone
from flows.inbox import INBOX, SUFFIXES, whole_logs
from reproduction.config import load_params
from reproduction.layout import Layout
from reproduction.measured.motions import measured_motions, read_measured
from reproduction.measured.predictor import predictor_of
from reproduction.tables import write_parquet
from reproduction.tracking.measured import record_measured
from reproduction.tracking.store import MEASURED, connect
from robojoule.calibration.log import read_log
from robojoule.documents import atomic_path, write_document, write_text
from robojoule.errors import InputError, RobojouleError
from robojoule.profile.predictor_file import save_profile_predictor
from robojoule.robots import load_robot
from robojoule.robots.robot import Robot

BRANCH = "measurements"
IDENTITY = ("-c", "user.name=ingest-measurements", "-c", "user.email=ingest@localhost")
_SET = Path("measured/runs.parquet")
_LOGS = Path("measured/logs")
_FIGURES = Path("measured/identified")
_PREDICTOR = Path("measured/energy_profile")


@flow(name="ingest-measurements", persist_result=False)
def ingest_measurements(
    inbox: Path = INBOX, robot: str | None = None, payload_kg: float | None = None, root: Path = Path()
) -> dict[str, str]:
    """Take in the logs of an inbox.

    Args:
        inbox: Folder in which they are; read logs go to `accepted` or `rejected` below it.
        robot: Name of the robot in the catalog; that of `params.yaml` if not given.
        payload_kg: What it carried; that of `params.yaml` if not given. [kg]
        root: Folder of the project.

    Returns:
        Log -> "accepted", or why it was rejected.

    Raises:
        InputError: Bad robot, or the record or the clone cannot be had.
    """
    logger, layout = get_run_logger(), Layout(root.resolve())
    logs = whole_logs(layout.root / inbox)
    if not logs:
        return {}
    params = load_params(layout.root / "params.yaml").robot
    mass_kg = params.payload_kg if payload_kg is None else payload_kg
    machine = load_robot(robot or params.name, payload_kg=mass_kg)
    mlflow = connect(layout, MEASURED)
    outcome: dict[str, str] = {}
    with scratch_clone(layout.root) as clone:
        git, dvc = _tool(clone, "git"), _tool(clone, sys.executable, "-m", "dvc")
        known = _open_branch(clone, git, dvc, machine)
        for path in logs:
            try:
                known = _taken(path, machine, known, clone)
                outcome[path.name] = "accepted"
            except InputError as error:
                outcome[path.name] = str(error)
            logger.info("%s: %s", path.name, outcome[path.name])
        if known is not None and "accepted" in outcome.values():
            write_parquet(clone / _SET, known)
            try:
                found = predictor_of(machine, known)
            except InputError as error:
                logger.info("nothing is learnt yet: %s", error)
            else:
                save_profile_predictor(found.predictor, clone / _PREDICTOR)
                logger.info(record_measured(mlflow, layout, found, clone / _PREDICTOR, clone / _SET))
            dvc("add", "--quiet", *(str(one) for one in (_SET, _LOGS, _PREDICTOR) if (clone / one).exists()))
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
    return outcome


def _open_branch(clone: Path, git: Callable[..., None], dvc: Callable[..., None], machine: Robot) -> pa.Table | None:
    """Check the branch out, or begin it; returns the measured set so far."""
    try:
        git("checkout", "--quiet", BRANCH)
    except InputError:
        git("checkout", "--quiet", "-b", BRANCH)
    files = [f"{one}.dvc" for one in (_SET, _LOGS, _PREDICTOR) if (clone / f"{one}.dvc").exists()]
    if not files:
        return None
    dvc("checkout", "--quiet", *files)
    return read_measured(clone / _SET, machine.joint_count)


def _taken(path: Path, machine: Robot, known: pa.Table | None, clone: Path) -> pa.Table:
    """The measured set with a log's motions; its figures and the log itself are put into the clone.

    Raises:
        InputError: Why it is rejected.
    """
    from robojoule.api import identify  # brings scipy

    if known is not None and path.name in known["log"].to_pylist():
        raise InputError("a log of this name was taken in before", file=path.name)
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
    stem = path.name.partition(".")[0]
    write_document(clone / _FIGURES / f"{stem}.json", found.robot_file().model_dump(mode="json"))
    (clone / _LOGS).mkdir(parents=True, exist_ok=True)
    shutil.copy(path, clone / _LOGS / path.name)
    return rows if known is None else pa.concat_tables([known.select(rows.column_names), rows])


def _file(path: Path, said: str) -> None:
    """Move a log to those that were accepted, or to the rejected ones with the reason beside it."""
    target = path.parent / ("accepted" if said == "accepted" else "rejected")
    target.mkdir(exist_ok=True)
    if said != "accepted":
        write_text(target / f"{path.name}.reason.txt", said + "\n")
    path.replace(target / path.name)


def _tool(folder: Path, *command: str) -> Callable[..., None]:
    """A command line tool in a folder."""
    identity = IDENTITY if command == ("git",) else ()

    def run(*words: str) -> None:
        done = subprocess.run([*command, *identity, *words], cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            problem = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
            raise InputError(f"{Path(command[-1]).name} {words[0]} failed ({problem})", file=folder)

    return run


def main() -> None:
    """Put logs into the inbox, whole or not at all."""
    parser = argparse.ArgumentParser(prog="python -m flows.measurements", description=__doc__.splitlines()[0])
    parser.add_argument("logs", type=Path, nargs="+", metavar="FILE", help="logs of the machine")
    parser.add_argument("--inbox", type=Path, default=INBOX, help=f"folder (default: {INBOX})")
    arguments = parser.parse_args()
    try:
        for log in arguments.logs:
            if not log.is_file() or log.suffix.lower() not in SUFFIXES:
                raise InputError("this is not a log", file=log, allowed=f"a file ending with {', '.join(SUFFIXES)}")
            with atomic_path(arguments.inbox / log.name) as path:
                shutil.copyfile(log, path)
            print(f"{log.name} is in {arguments.inbox}")
    except RobojouleError as error:
        raise SystemExit(f"flows.measurements: {error}") from None


if __name__ == "__main__":
    main()
