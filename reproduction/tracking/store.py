"""The store of MLflow in the project's folder: connecting to it, and finding a training in it again.

Nothing in it is an output of the pipeline: what is recorded there (times, ids, commit) changes no result.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import sqlite3
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from reproduction.layout import Layout
from reproduction.settings import apply_settings
from reproduction.tracking.store_file import newest_run
from robojoule.documents import atomic_path, reason
from robojoule.errors import InputError, RobojouleError

PIPELINE = "pipeline"
STUDY = "cross-validation"
MEASURED = "measured-motions"
"""Experiments by purpose: trainings of the pipeline, those of the studies, those on measured motions."""
TRIAL = "ROBOJOULE_TRIAL"
"""Variable of the environment that names the trial to which trainings belong; see `promote`."""


class RecordError(RobojouleError):
    """A training is made, but could not be recorded."""


@dataclass(frozen=True)
class RecordedRun:
    """A training found in the store.

    Attributes:
        run_id: Its id in MLflow.
        experiment_id: Id of its experiment.
        model: Name of the model.
        data_hash: MD5 of the features that it was trained on.
        git_commit: Commit, with `-dirty` where the files differed from it.
    """

    run_id: str
    experiment_id: str
    model: str
    data_hash: str
    git_commit: str

    @property
    def page(self) -> str:
        """Where the run is shown below the address of `mlflow ui`."""
        return f"/#/experiments/{self.experiment_id}/runs/{self.run_id}"


def data_hash(path: Path) -> str:
    """MD5 of a file, the hash by which DVC knows it too."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "md5").hexdigest()


def config_hash(params: BaseModel) -> str:
    """MD5 of a stage's parameters."""
    text = json.dumps(params.model_dump(mode="json"), sort_keys=True)
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


def connect(layout: Layout, experiment: str = PIPELINE) -> Any:
    """MLflow, set to record in an experiment of the project's store; both are made if there are none.

    Where `MLFLOW_TRACKING_URI` names a server, that is the store. Called before a training starts, so that a store
    which cannot be used does not cost it.

    Raises:
        InputError: The store or the server cannot be used.
    """
    mlflow = open_store(layout)
    uri = store_uri(layout)
    if not _named():
        _TAKEN.add(uri)
    mlflow.set_tracking_uri(uri)
    mlflow.set_registry_uri(uri)
    with _said(uri):
        if mlflow.get_experiment_by_name(experiment) is None:
            place = None if uri.startswith("http") else layout.mlflow_artifacts.as_uri()
            with suppress(mlflow.exceptions.MlflowException):  # another training made it at the same moment
                mlflow.create_experiment(experiment, artifact_location=place)
        mlflow.set_experiment(experiment)
    return mlflow


def open_store(layout: Layout) -> Any:
    """MLflow, once its store is there and is found to work.

    A new store is made beside its name and renamed when its tables are complete: MLflow breaks one for good that
    several processes make at the same moment, or whose making is killed.

    Raises:
        InputError: The store or the server cannot be used.
    """
    mlflow = _mlflow()
    if _named():
        return mlflow
    from mlflow.store.tracking.sqlalchemy_store import SqlAlchemyStore

    def tables(path: Path) -> None:
        opened = SqlAlchemyStore(f"sqlite:///{path}", layout.mlflow_artifacts.as_uri())
        opened.engine.dispose()

    store = layout.mlflow_store
    with _alone(store), _said(f"sqlite:///{store}"):
        if not store.exists():
            for stale in store.parent.glob(".*.db"):  # begun by one that was killed
                stale.unlink()
            with atomic_path(store) as path:
                tables(path)
        else:
            tables(store)
    return mlflow


@contextmanager
def _said(uri: str) -> Iterator[None]:
    """Whatever MLflow, SQLAlchemy or SQLite find wrong with a store, as one sentence with the mend."""
    try:
        yield
    except RobojouleError:
        raise
    except Exception as error:  # each of the three has kinds of its own
        words = " ".join(str(error).split("[SQL:")[0].split())
        if "out-of-date database schema" in words:
            raise InputError(
                "the store of MLflow is of an older version", file=uri, allowed=f"it after `mlflow db upgrade {uri}`"
            ) from None
        mend = (
            "a running server, or MLFLOW_TRACKING_URI unset"
            if uri.startswith("http")
            else "a store that works, or none: move it away, and a new one is made"
        )
        raise InputError(
            f"the record of MLflow cannot be used ({words[:120]})", file=uri.removeprefix("sqlite:///"), allowed=mend
        ) from None


@contextmanager
def _alone(store: Path) -> Iterator[None]:
    """One process at a time."""
    try:
        store.parent.mkdir(parents=True, exist_ok=True)
        lock = store.with_name(f"{store.name}.lock").open("w")
    except OSError as error:
        raise InputError(f"the folder of MLflow's store cannot be written ({reason(error)})", file=store) from None
    with lock:
        try:
            import fcntl
        except ImportError:  # Windows: trainings that start together are for the user to avoid
            pass
        else:
            fcntl.flock(lock, fcntl.LOCK_EX)  # freed when the file is closed, also by a process that is killed
        yield


def find_run(layout: Layout, model: str, data: str, config: str | None = None) -> RecordedRun | None:
    """Newest finished training of `model` on given data; also one of a stage that DVC took from its cache.

    Args:
        layout: Folder of the project.
        model: Name of the model.
        data: `data_hash` of the features.
        config: `config_hash` of the parameters; None: any.

    Returns:
        The run, or None if this store has none.

    Raises:
        InputError: The store or the server cannot be used.
    """
    if not _named() and not layout.mlflow_store.exists():
        return None  # a look must not create a store
    wanted = {"data_hash": data, "model": model} | ({} if config is None else {"config_hash": config})
    if not _named():
        with suppress(sqlite3.Error):  # then MLflow itself is asked
            found = newest_run(layout.mlflow_store, PIPELINE, wanted, "git_commit")
            return None if found is None else RecordedRun(found[0], found[1], model, data, found[2])
    with _said(store_uri(layout)):
        return _newest(_mlflow().MlflowClient(tracking_uri=store_uri(layout)), wanted)


def _newest(client: Any, wanted: Mapping[str, str]) -> RecordedRun | None:
    """Newest finished run with some tags, asked of MLflow."""
    experiment = client.get_experiment_by_name(PIPELINE)
    if experiment is None:
        return None
    condition = " and ".join([f"tags.{key} = '{value}'" for key, value in wanted.items()])
    runs = client.search_runs(
        [experiment.experiment_id],
        f"{condition} and attributes.status = 'FINISHED'",
        max_results=1,
        order_by=["attributes.start_time DESC"],
    )
    if not runs:
        return None
    tags = runs[0].data.tags
    run = runs[0].info.run_id
    return RecordedRun(run, experiment.experiment_id, wanted["model"], wanted["data_hash"], tags["git_commit"])


def store_uri(layout: Layout) -> str:
    """Address of the store: the one that the environment names, or the project's file."""
    return _named() or f"sqlite:///{layout.mlflow_store}"


_TAKEN: set[str] = set()  # MLflow puts the store that it is told to use into the environment


def _named() -> str | None:
    """The store that the user's environment names."""
    named = os.environ.get("MLFLOW_TRACKING_URI")
    return None if named in _TAKEN else named


def _mlflow() -> Any:
    """MLflow, imported only where something is recorded or looked up, because that takes some 10 s."""
    apply_settings()
    os.environ.setdefault("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "2")  # a stopped server is told of at once
    os.environ.setdefault("MLFLOW_ENABLE_ARTIFACTS_PROGRESS_BAR", "false")
    os.environ.setdefault("MLFLOW_UV_AUTO_DETECT", "false")  # a model needs the few packages named with it
    import mlflow

    logging.getLogger("mlflow").setLevel(logging.WARNING)
    logging.getLogger("mlflow.utils.environment").setLevel(logging.ERROR)  # complains where there is no pip
    return mlflow


def git_commit(folder: Path) -> str:
    """Commit of the code, `-dirty` where tracked files differ from it; `unknown` outside a repository."""
    try:
        done = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"],
            cwd=folder,
            capture_output=True,
            text=True,
            check=True,
            timeout=60,
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return done.stdout.strip()


def tags(layout: Layout, params: BaseModel, stage: str) -> dict[str, str]:
    """What tells trainings of a stage apart: data, parameters, commit, lock file, and sweep or trial, if any."""
    own = {"data_hash": data_hash(layout.features), "config_hash": config_hash(params), "dvc_stage": stage}
    return own | of_the_code(layout)


def of_the_code(layout: Layout, lock: str = "dvc.lock") -> dict[str, str]:
    """What every training is known by: commit, lock file, and sweep or trial, if any.

    Args:
        layout: Folder of the project.
        lock: The lock file below it that its data are in.
    """
    found = {"git_commit": git_commit(Path(__file__).parent)}
    if (layout.root / lock).exists():
        found["lock_hash"] = data_hash(layout.root / lock)
    if "DVC_EXP_NAME" in os.environ:
        found["dvc_experiment"] = os.environ["DVC_EXP_NAME"]
    if TRIAL in os.environ:
        found["trial"] = os.environ[TRIAL]
    return found


def log_data(mlflow: Any, *paths: Path) -> None:
    """Log files as the data of a training, each with the hash by which DVC knows it."""
    from mlflow.data.dataset_source_registry import resolve_dataset_source
    from mlflow.data.meta_dataset import MetaDataset

    for path in paths:
        source = resolve_dataset_source(path.resolve().as_uri())
        mlflow.log_input(MetaDataset(source, name=path.stem, digest=data_hash(path)), context="training")


@contextmanager
def recording(layout: Layout) -> Iterator[None]:
    """Tell what fails while a training is recorded as a `RecordError`: the training itself is made."""
    try:
        with _said(store_uri(layout)):
            yield
    except InputError as error:
        raise RecordError(f"the trainings are made, but not all of them are recorded: {error}") from None


@contextmanager
def trial(name: str) -> Iterator[None]:
    """Trainings of this process, and of those that it starts meanwhile, are a trial of that name; see `promote`."""
    os.environ[TRIAL] = name
    try:
        yield
    finally:
        del os.environ[TRIAL]


def promote(mlflow: Any, name: str, version: str) -> None:
    """Make a version of a registered model the champion; the one that was is `previous`.

    A sweep of DVC and a run under `ROBOJOULE_TRIAL` leave both as they are: who tries another robot or a smaller forest
    must not change what others plan with.
    """
    if any(name in os.environ for name in (TRIAL, "DVC_EXP_NAME")):
        return
    client = mlflow.MlflowClient()
    last = client.get_registered_model(name).aliases.get("champion")
    if last is not None and str(last) != version:
        client.set_registered_model_alias(name, "previous", str(last))
    client.set_registered_model_alias(name, "champion", version)


def figures_of(model: str, metrics: Mapping[str, Mapping[str, Mapping[str, float]]]) -> dict[str, float]:
    """Figures of one model, from target -> model -> figure, named as in `reports/metrics.json`."""
    return {
        f"predictors.{group}.{model}.{name}": value
        for group, by_model in metrics.items()
        for name, value in by_model.get(model, {}).items()
    }
