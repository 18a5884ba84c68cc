"""A desk for a team: both servers on a real PostgreSQL, each asking for a password."""

import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psycopg2
import pytest

from tests.conftest import ROOT, free_port, run, wait_for
from tests.flows.test_desk import desk, ports, project  # noqa: F401  fixtures
from tests.flows.test_schedule import PATIENCE_S

SECRET = "of-this-test"


def program(name: str) -> str:
    """One of PostgreSQL's programs, which Debian keeps apart by version; the test is skipped where there is none."""
    found = [shutil.which(name), *sorted(map(str, Path("/usr/lib/postgresql").glob(f"*/bin/{name}")))]
    if not (known := [one for one in found if one]):
        pytest.skip("needs PostgreSQL")
    return known[-1]


@pytest.fixture
def postgres() -> Iterator[str]:
    """Address of a cluster of its own, `postgresql://USER:PASSWORD@HOST:PORT`; it refuses to run as root."""
    initdb, pg_ctl = program("initdb"), program("pg_ctl")
    user = ["setpriv", "--reuid=nobody", "--regid=nogroup", "--clear-groups"] if os.getuid() == 0 else []
    port = free_port()
    with tempfile.TemporaryDirectory(prefix="postgres-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        (folder / "password").write_text(SECRET, encoding="utf-8")
        (folder / "data").mkdir()
        if user:
            for path in (folder, *folder.iterdir()):
                shutil.chown(path, "nobody", "nogroup")
        words = ["--username=robojoule", "--auth=scram-sha-256", f"--pwfile={folder}/password", "--no-sync"]
        run(*user, initdb, "--encoding=UTF8", *words, str(folder / "data"), cwd=folder)
        options = f"-p {port} -h 127.0.0.1 -c unix_socket_directories='' -c fsync=off"
        control = [*user, pg_ctl, "--pgdata", str(folder / "data"), "--wait"]
        # Its output goes to a file: the server would keep a pipe open.
        run(*control, "--log", str(folder / "log"), "-o", options, "start", cwd=folder)
        try:
            yield f"postgresql://robojoule:{SECRET}@127.0.0.1:{port}"
        finally:
            subprocess.run([*control, "--mode=immediate", "stop"], cwd=folder, capture_output=True, check=False)


def ask(address: str, body: dict[str, Any], login: str | None) -> int:
    """Status with which a server answers a request, with or without a user's name and password."""
    request = urllib.request.Request(address, json.dumps(body).encode(), {"content-type": "application/json"})
    if login is not None:
        request.add_header("authorization", f"Basic {base64.b64encode(login.encode()).decode()}")
    try:
        with urllib.request.urlopen(request, timeout=60) as reply:
            return int(reply.status)
    except urllib.error.HTTPError as error:
        return error.code


def count(address: str, query: str) -> int:
    connection = psycopg2.connect(address)
    try:
        with connection.cursor() as cursor:
            cursor.execute(query)
            return int(cursor.fetchone()[0])
    finally:
        connection.close()


TRAINING = """
from reproduction.layout import Layout
from reproduction.tracking.store import connect
with connect(Layout()).start_run(run_name="shared"):
    pass
"""


def test_both_servers_on_postgresql_with_passwords(
    postgres: str,
    project: Path,  # noqa: F811
    ports: dict[str, str],  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
):
    connection = psycopg2.connect(f"{postgres}/postgres")
    connection.autocommit = True
    with connection.cursor() as cursor:
        for name in ("prefect", "mlflow"):
            cursor.execute(f"CREATE DATABASE {name}")
    connection.close()
    prefect, mlflow = (f"http://127.0.0.1:{ports[name]}" for name in ("PREFECT_SERVER_API_PORT", "MLFLOW_PORT"))
    settings = {
        "PREFECT_SERVER_DATABASE_CONNECTION_URL": f"{postgres}/prefect".replace("://", "+asyncpg://"),
        "PREFECT_SERVER_API_AUTH_STRING": f"team:{SECRET}",
        "PREFECT_API_AUTH_STRING": f"team:{SECRET}",
        "MLFLOW_BACKEND_STORE_URI": f"{postgres}/mlflow",
        "MLFLOW_AUTH_ADMIN_PASSWORD": f"{SECRET}-admin",
        "MLFLOW_FLASK_SERVER_SECRET_KEY": SECRET,
        "MLFLOW_TRACKING_USERNAME": "admin",
        "MLFLOW_TRACKING_PASSWORD": f"{SECRET}-admin",
    }
    page = (ROOT / "docs/operations.md").read_text(encoding="utf-8")
    for name, value in settings.items():
        assert f"\n{name}=" in page  # the page names every one of them
        monkeypatch.setenv(name, value)
    before = set(project.rglob("*.db"))
    desk(project, "up")

    # Both refuse who has no password or another one.
    flows, experiments = f"{prefect}/api/flows/filter", f"{mlflow}/api/2.0/mlflow/experiments/search"
    for login, status in ((None, 401), ("team:wrong", 401), (f"team:{SECRET}", 200)):
        assert ask(flows, {}, login) == status
    for login, status in ((None, 401), ("admin:wrong", 401), (f"admin:{SECRET}-admin", 200)):
        assert ask(experiments, {"max_results": 10}, login) == status

    # Worker and trainings know it; what they write is in PostgreSQL, and nothing in files.
    told = ["-p", "run=a", "-p", "flow_name=b", "-p", "state=Failed", "-p", "message=c"]
    monkeypatch.setenv("PREFECT_API_URL", f"{prefect}/api")
    run("prefect", "deployment", "run", "alert/alert", *told, cwd=project)
    wait_for("the alert", (project / ".desk/alerts.jsonl").exists, PATIENCE_S)
    ended = "SELECT count(*) FROM flow_run WHERE state_type = 'COMPLETED'"
    wait_for("its end", lambda: count(f"{postgres}/prefect", ended) == 1, PATIENCE_S)
    monkeypatch.setenv("MLFLOW_TRACKING_URI", mlflow)
    run(sys.executable, "-c", TRAINING, cwd=project)
    assert count(f"{postgres}/mlflow", "SELECT count(*) FROM runs WHERE name = 'shared'") == 1
    monkeypatch.setenv("MLFLOW_TRACKING_PASSWORD", "wrong")
    refused = run(sys.executable, "-c", TRAINING, cwd=project, code=1).stderr
    assert "cannot be used" in refused.splitlines()[-1] and SECRET not in refused
    new = {path.relative_to(project).as_posix() for path in set(project.rglob("*.db")) - before}
    assert {path for path in new if not path.startswith((".dvc/", ".desk/empty/"))} == {".desk/mlflow-users.db"}
    desk(project, "down")
