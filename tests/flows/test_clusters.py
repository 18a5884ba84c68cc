"""The same bytes from real clusters of several processes as from one process: sets of motions, the pipeline's own."""

import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

import pytest
import yaml

from flows.cells import plan_cell
from flows.fan_out import FANNED, compute_parts
from flows.runners import task_runner
from flows.scale import scale
from reproduction.layout import Layout
from reproduction.motions.shards import MotionSet
from reproduction.study.regimes import unseen_robot
from robojoule.documents import parse
from robojoule.planning.cells.check import check_plan
from stages import evaluate_robots
from tests.conftest import ROOT, Background, free_port, run, wait_for
from tests.flows.test_scale import files, made_here
from tests.planning.cells.cases import generated
from tests.reproduction.closed_loop.cases import small
from tests.reproduction.motions.test_shards import DESCRIPTION
from tests.reproduction.study.cases import small_study
from tests.reproduction.test_parts import Refusing

STARTED = 900.0  # longest time until a cluster is up; Ray takes a minute on a busy machine, more on an overloaded one


def dask(background: Background, folder: Path) -> str:
    """Address of a scheduler with two workers, each a process."""
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    python = f"{sys.executable} -m distributed.cli"
    background.start(f"{python}.dask_scheduler --host 127.0.0.1 --port {port} --no-dashboard", folder, folder / "s.log")
    words = f"{address} --nworkers 2 --nthreads 1 --host 127.0.0.1 --no-dashboard --preload stages"
    background.start(f"{python}.dask_worker {words}", folder, folder / "w.log")
    wait_for("workers", lambda: (folder / "s.log").read_text(encoding="utf-8").count("Register worker") == 2, STARTED)
    return address


def ray(background: Background, folder: Path) -> str:
    """Address of a head node with two processors."""
    port, own = free_port(), tempfile.mkdtemp(prefix="ray-")  # sockets bear no long paths
    words = f"--port {port} --node-ip-address 127.0.0.1 --num-cpus 2 --include-dashboard false --temp-dir {own}"
    background.start(f"ray start --head --block --disable-usage-stats {words}", folder, folder / "ray.log")
    wait_for("Ray", lambda: "Ray runtime started" in (folder / "ray.log").read_text(encoding="utf-8"), STARTED)
    return f"127.0.0.1:{port}"


@pytest.fixture(params=[dask, ray], ids=["dask", "ray"])
def cluster(
    request: pytest.FixtureRequest, background: Background, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[str, str]]:
    """Name of a task runner, and the address of its cluster, whose workers find the project's code."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("RAY_AUTH_MODE", "disabled")  # else a token in the home folder counts for the head alone
    (tmp_path / "cluster").mkdir()
    make: Callable[[Background, Path], str] = request.param
    yield make.__name__, make(background, tmp_path / "cluster")
    if make is ray:
        import ray as package

        package.shutdown()


def test_bytes_do_not_depend_on_the_engine(
    cluster: tuple[str, str], reproduced: Path, tmp_path: Path, prefect_server: str
):
    """A set of motions; then stages of the pipeline and of the studies: their parts come from the cluster."""
    name, address = cluster
    motion_set = parse(MotionSet, DESCRIPTION, "test")
    assert scale(motion_set, tmp_path / "set", name, 2, address) == 3
    assert files(tmp_path / "set") == made_here(motion_set, tmp_path / "here")

    project = tmp_path / "project"
    shutil.copytree(reproduced, project, symlinks=True)
    study = small_study().model_copy(update={"close_the_loop": small()})
    (project / "studies/params.yaml").write_text(yaml.safe_dump(study.model_dump(mode="json")), encoding="utf-8")
    parts = compute_parts.with_options(task_runner=task_runner(name, address=address))
    layout, scratch = Layout(project), Layout(project).scratch_dir
    for stage in ("simulate_motions", "evaluate_plans", "evaluate_robots"):
        parts(stage, project)
        (kept,) = (scratch / stage).iterdir()
        before = {path.name: path.stat().st_mtime_ns for path in kept.iterdir()}
        assert len(before) >= 2
        computed = import_module(f"stages.{stage}").compute
        file, load = FANNED[stage]
        computed(load(project / file), layout, Refusing())  # all are there: nothing is computed
        assert {path.name: path.stat().st_mtime_ns for path in kept.iterdir()} == before
    for stage in ("simulate_motions", "evaluate_plans"):
        run(sys.executable, "-m", f"stages.{stage}", "--root", str(project), cwd=ROOT)
        assert not list((scratch / stage).iterdir())
    for file in ("motions", "runs", "paths", "plans"):
        made, expected = (getattr(Layout(root), file).read_bytes() for root in (project, reproduced))
        assert made == expected, file
    assert files(layout.samples_dir) == files(Layout(reproduced).samples_dir)
    found = evaluate_robots.compute(study, layout, Refusing())[1]
    assert found == unseen_robot(study, lambda text: None)

    if name == "dask":  # calls take the same way on both; a search takes long enough on one
        cell = generated(3, 0, (8, 10))
        plan = plan_cell(cell, time_limit_s=120.0, gap_percent=30.0, seeds=2, runner=name, address=address)
        assert check_plan(cell, plan).feasible
