"""The same bytes from real clusters of several processes as from one process: sets of motions, the pipeline's own."""

import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from flows.fan_out import make_shards, missing_shards
from flows.runners import task_runner
from flows.scale import scale
from reproduction.layout import Layout
from reproduction.motions.shards import MotionSet
from robojoule.documents import parse
from tests.conftest import ROOT, Background, free_port, run, wait_for
from tests.flows.test_scale import files, made_here
from tests.reproduction.motions.test_shards import DESCRIPTION

STARTED = 300.0  # longest time until a cluster is up; Ray takes a minute on a busy machine


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
    (tmp_path / "cluster").mkdir()
    make: Callable[[Background, Path], str] = request.param
    yield make.__name__, make(background, tmp_path / "cluster")
    if make is ray:
        import ray as package

        package.shutdown()


def test_bytes_do_not_depend_on_the_engine(
    cluster: tuple[str, str], reproduced: Path, tmp_path: Path, prefect_server: str
):
    """A set of motions, then the simulation of the pipeline: its shards come from the cluster, the stage takes them."""
    name, address = cluster
    motion_set = parse(MotionSet, DESCRIPTION, "test")
    assert scale(motion_set, tmp_path / "set", name, 2, address) == 3
    assert files(tmp_path / "set") == made_here(motion_set, tmp_path / "here")

    project = tmp_path / "project"
    shutil.copytree(reproduced, project, symlinks=True)
    shards = missing_shards(Layout(project))
    assert len(shards) >= 2
    assert make_shards.with_options(task_runner=task_runner(name, address=address))(shards) == len(shards)
    assert missing_shards(Layout(project)) == []
    said = run(sys.executable, "-m", "stages.simulate_motions", "--root", str(project), cwd=ROOT).stdout
    assert f"{len(shards)} of {len(shards)} shards are there already" in said
    for file in ("motions", "runs", "paths"):
        made, expected = (getattr(Layout(root), file).read_bytes() for root in (project, reproduced))
        assert made == expected
    assert files(Layout(project).samples_dir) == files(Layout(reproduced).samples_dir)
