"""The schedule for real: server, pool, deployment, worker, and one scheduled run of all stages."""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import yaml

from tests.conftest import Background, run, wait_for
from tests.flows.test_pipeline import artifacts, post


@contextmanager
def forced(path: Path) -> Iterator[None]:
    """The deployment file, for a while, with runs that execute every stage."""
    text = path.read_text(encoding="utf-8")
    document = yaml.safe_load(text)
    document["deployments"][0]["parameters"] = {"force": True}
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    try:
        yield
    finally:
        path.write_text(text, encoding="utf-8")


def test_a_scheduled_run_repeats_all_stages_with_the_same_bytes(
    reproduced: Path, prefect_server: str, background: Background, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Server (up already), pool, deployment, worker and a second schedule as described; the run is forced.

    It must execute every stage, leave `dvc.lock` as `dvc repro` wrote it, and publish its artifacts.
    """
    lock = (reproduced / "dvc.lock").read_bytes()
    monkeypatch.setenv("PREFECT_WORKER_QUERY_SECONDS", "2")
    soon = datetime.now(UTC) + timedelta(seconds=30)
    schedule = f"--interval 7200 --anchor-date {soon:%Y-%m-%dT%H:%M:%S}"
    commands = [
        "prefect work-pool create local --type process",
        "prefect --no-prompt deploy --all",
        "prefect worker start --pool local &",
        f"prefect deployment schedule create pipeline/nightly {schedule}",
    ]
    for number, command in enumerate(commands):
        if command.endswith("&"):
            background.start(command.removesuffix("&"), reproduced, tmp_path / f"{number}.log")
        else:
            with forced(reproduced / "prefect.yaml"):
                run("bash", "-c", command, cwd=reproduced)

    ended = {"flow_runs": {"state": {"type": {"any_": ["COMPLETED", "FAILED", "CRASHED"]}}}}

    def scheduled_runs() -> list[dict]:
        return [found for found in post(prefect_server, "flow_runs/filter", ended) if found["auto_scheduled"]]

    wait_for("end of the scheduled run", lambda: bool(scheduled_runs()), 300)
    (found,) = scheduled_runs()
    assert found["state"]["type"] == "COMPLETED", found["state"]
    assert (reproduced / "dvc.lock").read_bytes() == lock

    for key in ("stages", "table-6-1", "training-runs"):
        assert found["id"] == artifacts(prefect_server, key)[0]["flow_run_id"]
    assert artifacts(prefect_server, "stages")[0]["data"] == 100.0
    assert "/runs/" in artifacts(prefect_server, "training-runs")[0]["data"]
    wanted = {"logs": {"flow_run_id": {"any_": [found["id"]]}}, "limit": 200, "sort": "TIMESTAMP_ASC"}
    messages = [entry["message"] for entry in post(prefect_server, "logs/filter", wanted)]
    stages = yaml.safe_load((reproduced / "dvc.yaml").read_text(encoding="utf-8"))["stages"]
    assert [m for m in messages if m.startswith("Running stage")] == [f"Running stage '{name}':" for name in stages]
