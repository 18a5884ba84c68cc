"""The desk: both servers, a worker and the watch on the inbox, on this machine: `python -m flows.desk up|down|status`.

Stores, logs and process files are in `.desk`, which git ignores. Each command can be given twice.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from datetime import datetime
from functools import partial
from pathlib import Path

from flows.command import told
from flows.service import ProcessFile, Service, answers
from reproduction.layout import Layout
from reproduction.settings import address
from reproduction.tracking.store import open_store
from robojoule.documents import read_document, write_text
from robojoule.errors import RobojouleError, require_package

POOL = "local"
# Who holds which slot is kept in files: in memory, as is Prefect's default, a server that is started again would know
# nothing of runs that go on, and end them.
_LEASES, _LEASES_IN = "PREFECT_SERVER_CONCURRENCY_LEASE_STORAGE", "prefect.server.concurrency.lease_storage"
_USERS = "MLFLOW_AUTH_CONFIG_PATH"
SERVICES = ("prefect-server", "mlflow-server", "prefect-worker", "inbox-watch")


def services(layout: Layout) -> list[Service]:
    """The programs of the desk in the order in which they start."""
    desk, prefect, mlflow = layout.desk_dir.resolve(), address("prefect"), address("mlflow")
    store = os.environ.get("MLFLOW_BACKEND_STORE_URI", f"sqlite:///{layout.mlflow_store}")
    environment = prefect_environment(layout)
    service = partial(Service, folder=desk, cwd=layout.root.resolve())
    stored = ["--backend-store-uri", store, "--default-artifact-root", layout.mlflow_artifacts.as_uri()]
    app: list[str] = []
    users: dict[str, str] = {}
    if _with_users():  # without, MLflow would read the file as well, and fail where there is none
        app = ["--app-name", "basic-auth"]
        users = {_USERS: os.environ.get(_USERS, str(_users_file(layout)))}
    python = [sys.executable, "-m"]
    return [
        service(
            "prefect-server",
            [*python, *["prefect", "server", "start"]],
            environment=environment | {_LEASES: os.environ.get(_LEASES, f"{_LEASES_IN}.filesystem")},
            health=f"{prefect}/api/health",
        ),
        service(
            "mlflow-server",
            [*python, *["mlflow", "server", "--workers", "1"], *app, *stored],
            environment=users,
            health=f"{mlflow}/health",
        ),
        service(
            "prefect-worker",
            [*python, *f"prefect worker start --pool {POOL} --type process --name desk --with-healthcheck".split()],
            environment=environment,
            health=f"{worker_address()}/health",
            grace_s=40.0,
        ),
        service("inbox-watch", [*python, "flows.inbox"], environment=environment, ready="looks into"),
    ]


def worker_address() -> str:
    """Where the worker says how it is: one port above the Prefect server's, unless the environment names it."""
    host, _, port = address("prefect").rpartition(":")
    return f"{host}:{os.environ.get('PREFECT_WORKER_WEBSERVER_PORT', int(port) + 1)}"


def prefect_environment(layout: Layout) -> dict[str, str]:
    """Variables by which programs reach the desk's server and keep what they keep in its folder."""
    host, _, port = worker_address().removeprefix("http://").rpartition(":")
    return {
        "PREFECT_HOME": str(layout.desk_dir.resolve() / "prefect"),
        "PREFECT_API_URL": f"{address('prefect')}/api",
        "PREFECT_UI_URL": address("prefect"),
        "MLFLOW_TRACKING_URI": address("mlflow"),
        "PREFECT_WORKER_WEBSERVER_HOST": host,
        "PREFECT_WORKER_WEBSERVER_PORT": port,
    }


def _with_users() -> bool:
    """Whether MLflow's server asks for a user's password: where the secret is set that it needs for that."""
    return bool(os.environ.get("MLFLOW_FLASK_SERVER_SECRET_KEY"))


def _users_file(layout: Layout) -> Path:
    return layout.desk_dir.resolve() / "mlflow-users.ini"


def prepare_mlflow(layout: Layout) -> None:
    """Make the store of MLflow, and say where its users are kept; both beside the other stores.

    Raises:
        RobojouleError: They cannot be made, or the package that asks for passwords is missing.
    """
    if "MLFLOW_BACKEND_STORE_URI" not in os.environ:
        open_store(layout)
    if _with_users():
        require_package("flask_wtf", "auth", "a password for MLflow")
        users = f"sqlite:///{layout.desk_dir.resolve() / 'mlflow-users.db'}"
        lines = ("[mlflow]", "default_permission = READ", "admin_username = admin", f"database_uri = {users}")
        write_text(_users_file(layout), "\n".join(lines) + "\n")


def up(layout: Layout) -> None:
    """Start what does not run; make work pool and deployments.

    Raises:
        InputError: `prefect.yaml` is damaged; nothing is started.
        RobojouleError: A program does not start, or the deployments are refused.
    """
    read_document(layout.root / "prefect.yaml")  # Prefect would not say what is wrong with it
    prepare_mlflow(layout)
    *servers, worker, watch = services(layout)
    _start(servers)
    runs = worker.process() is not None
    if not runs:
        worker.stop()  # what is left of a worker that was killed
    make_pool(layout, worker_runs=runs)  # also closes runs that lost their server for too long
    _start([worker, watch], meanwhile=partial(deploy, layout))
    print(f"\nPrefect  {address('prefect')}\nMLflow   {address('mlflow')}\nlogs     {layout.desk_dir / 'log'}")


def _start(started: Sequence[Service], meanwhile: Callable[[], None] = lambda: None) -> None:
    """Start programs at the same time, do something else while they load, and wait until each is ready."""
    launched = [service.launch() for service in started]
    meanwhile()
    for service, new in zip(started, launched, strict=True):
        service.wait(new)
        print(f"{service.name:<15} {'started' if new else 'runs already'}", flush=True)


def deploy(layout: Layout) -> None:
    """Make the deployments of `prefect.yaml`, or bring them up to date."""
    _run(layout, "-m", "prefect", "--no-prompt", "deploy", "--all")


def _run(layout: Layout, *words: str) -> None:
    """Run a command of the desk's environment to its end."""
    done = subprocess.run(
        [sys.executable, *words],
        cwd=layout.root,
        # prefect.yaml writes PWD into the deployments: a process started here would pass on that of its own start.
        env={**os.environ, **prefect_environment(layout), "PWD": str(layout.root.resolve())},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        lines = [line.strip() for line in (done.stdout + done.stderr).splitlines() if line.strip()]
        raise RobojouleError(f"`python {' '.join(words)}` failed: {lines[-1] if lines else 'no output'}")


def run_here(layout: Layout, name: str) -> None:
    """Become one of the programs, for a service manager that starts and ends each of them itself (deploy/).

    The worker waits for its server, makes the deployments and closes what was cut off with the last worker. The process
    is noted as those of `up` are, so that `status` and `deploy/activate` know of it.

    Raises:
        RobojouleError: It runs already, the server does not answer, or the deployments are refused.
    """
    (service,) = [one for one in services(layout) if one.name == name]
    if service.process() is not None:
        raise RobojouleError(f"{name} runs already")
    if name == "mlflow-server":
        prepare_mlflow(layout)
    if name == "prefect-worker":
        health, end = f"{address('prefect')}/api/health", time.monotonic() + service.patience_s
        while not answers(health):
            if time.monotonic() > end:
                raise RobojouleError(f"no Prefect server answers at {health}")
            time.sleep(1.0)
        make_pool(layout)
        deploy(layout)
    (layout.desk_dir / "prefect").mkdir(parents=True, exist_ok=True)
    service.note(ProcessFile.of(os.getpid(), managed=True))  # the number stays
    os.chdir(service.cwd)
    os.execve(service.command[0], list(service.command), {**os.environ, **service.environment})


def make_pool(layout: Layout, worker_runs: bool = False) -> None:
    """Make the work pool, and close its lost runs: of a worker that was killed, or while no server could be told."""
    _run(layout, "-m", "flows.pool", POOL, *(["--worker-runs"] if worker_runs else []))


def down(layout: Layout) -> None:
    """End what `up` started, the worker first."""
    for service in reversed(services(layout)):
        ended = service.stop()
        if ended and service.name == "prefect-worker" and answers(f"{address('prefect')}/api/health"):
            make_pool(layout)  # a run that was cut off counts as one, and frees its slot, from now on
        left = "runs on, as its service manager started it" if service.process() else "does not run"
        print(f"{service.name:<15} {'ended' if ended else left}", flush=True)


def status(layout: Layout) -> bool:
    """Print what runs; returns whether everything does."""
    every = True
    for service in services(layout):
        process = service.process()
        every = every and process is not None
        if process is None:
            noted = service.noted()
            said = "was killed" if noted and not noted.managed else "does not run"
        else:
            since = datetime.fromtimestamp(process.create_time()).strftime("%Y-%m-%d %H:%M")
            said = f"runs since {since} as process {process.pid}"
        place = {"prefect-server": address("prefect"), "mlflow-server": address("mlflow")}.get(service.name, "")
        print(f"{service.name:<15} {said:<45} {place}".rstrip())
    return every


def main() -> None:
    """Run one command; `status` ends with exit code 3 where something does not run."""
    parser = argparse.ArgumentParser(prog="python -m flows.desk", description=__doc__.splitlines()[0])
    parser.add_argument("command", choices=("up", "down", "status", "run"))
    parser.add_argument("service", nargs="?", choices=SERVICES, help="with run: the program to become")
    parser.add_argument("--root", type=Path, default=Path(), help="folder of dvc.yaml (default: .)")
    arguments = parser.parse_args()
    layout = Layout(arguments.root)
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # so do scripts start what they put into the background
        signal.signal(signal.SIGINT, signal.default_int_handler)  # programs inherit it: Prefect's worker ends by SIGINT
    with told("flows.desk"):
        if arguments.command == "status":
            raise SystemExit(0 if status(layout) else 3)
        if arguments.command == "run":
            if arguments.service is None:
                parser.error(f"run needs one of {', '.join(SERVICES)}")
            run_here(layout, arguments.service)
        {"up": up, "down": down}[arguments.command](layout)


if __name__ == "__main__":
    main()
