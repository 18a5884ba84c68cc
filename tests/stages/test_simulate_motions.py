"""The stage that simulates: files of the contract, same bytes each time, clear errors."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from reproduction.config import Params
from reproduction.layout import Layout
from reproduction.motions.simulate import planned_shards, read_motions
from robojoule.errors import InputError
from stages.generate_trees import generate_trees
from stages.simulate_motions import simulate_motions
from tests.cli.test_missing_packages import WITHOUT
from tests.conftest import wait_for

ROOT = Path(__file__).parents[2]
PARAMS = yaml.safe_load((ROOT / "params.yaml").read_text())
PARAMS["generate_trees"] |= {"trees": 4, "experiment_trees": 3}
PARAMS["simulate_motions"] |= {"shard_motions": 30}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    layout = Layout(tmp_path_factory.mktemp("run"))
    params = Params.model_validate(PARAMS)
    generate_trees(params, layout)
    simulate_motions(params, layout)
    return params, layout


def test_files_of_the_contract(done):
    _, layout = done
    assert pq.read_table(layout.motions).num_rows == 70
    runs = pq.read_table(layout.runs)
    assert runs.num_rows == 700
    assert runs["motion_id"].to_pylist() == [motion for motion in range(70) for _ in range(10)]
    assert [path.name for path in sorted(layout.samples_dir.iterdir())] == [f"part-000{i}.parquet" for i in range(3)]
    assert pq.read_table(layout.paths).num_rows == 70


def test_metrics_are_plausible(done):
    import json

    _, layout = done
    metrics = json.loads((layout.metrics_dir / "energy_model.json").read_text())
    assert metrics["idle_power_home_w"] == pytest.approx(430, rel=0.03)
    assert metrics["idle_power_min_w"] <= metrics["idle_power_home_w"] <= metrics["idle_power_max_w"]
    assert 900 < metrics["mean_power_full_speed_w"] < 2200


def test_shards_do_not_change_the_result_and_stale_ones_go(done, tmp_path):
    params, layout = done
    again = Layout(tmp_path)
    generate_trees(params, again)
    again.samples_dir.mkdir(parents=True)
    (again.samples_dir / "part-0099.parquet").write_bytes(b"stale")
    coarse = params.model_copy(
        update={"simulate_motions": params.simulate_motions.model_copy(update={"shard_motions": 70})}
    )
    simulate_motions(coarse, again)
    for name in ("motions", "runs", "paths"):
        assert getattr(again, name).read_bytes() == getattr(layout, name).read_bytes()
    assert [path.name for path in again.samples_dir.iterdir()] == ["part-0000.parquet"]
    together = pq.read_table(layout.samples_dir)
    assert pq.read_table(again.samples_dir).equals(together)


def test_unreadable_trees_are_named(done, tmp_path):
    layout = Layout(tmp_path)
    layout.data_dir.mkdir()
    layout.trees.write_bytes(b"not a table")
    with pytest.raises(InputError, match=r"trees\.parquet: the file cannot be read"):
        simulate_motions(done[0], layout)


BAD_TREES = {
    "column": (lambda t: t.drop_columns(["point"]), "point: this column is missing"),
    "joint": (lambda t: t.drop_columns(["q6_rad"]), "q6_rad: this column is missing"),
    "joint too many": (lambda t: t.append_column("q7_rad", t["q1_rad"]), "q7_rad: the robot has 6 joints only"),
    "text": (
        lambda t: t.drop_columns(["q2_rad"]).append_column("q2_rad", t["split"]),
        "q2_rad: the column holds string",
    ),
    "empty cells": (
        lambda t: t.drop_columns(["q2_rad"]).append_column("q2_rad", pa.array([None] * len(t), pa.float64())),
        "q2_rad: 77 rows are empty or not finite numbers",
    ),
    "no rows": (lambda t: t.slice(0, 0), "there is no motion; allowed: two points of a tree or more"),
}


@pytest.mark.parametrize("change, message", BAD_TREES.values(), ids=BAD_TREES)
def test_trees_with_a_gap_are_refused_before_anything_is_written(done, tmp_path, change, message):
    params, layout = done[0], Layout(tmp_path)
    layout.data_dir.mkdir()
    pq.write_table(change(pq.read_table(done[1].trees)), layout.trees)
    with pytest.raises(InputError) as caught:
        simulate_motions(params, layout)
    assert message in str(caught.value)
    assert [path.name for path in tmp_path.rglob("*.*")] == ["trees.parquet"]


def test_without_trees_the_message_names_the_stage(done, tmp_path):
    with pytest.raises(InputError, match="the file is missing; run the stage generate_trees first"):
        simulate_motions(done[0], Layout(tmp_path))


def simulate_without_packages(done, folder, **engines):
    """Run the stage on the same trees where Pinocchio and Ruckig cannot be imported."""
    layout = Layout(folder)
    layout.data_dir.mkdir()
    shutil.copy(done[1].trees, layout.trees)
    params = PARAMS | {"simulate_motions": PARAMS["simulate_motions"] | engines}
    (folder / "params.yaml").write_text(yaml.safe_dump(params))
    stage = "import runpy\nrunpy.run_module('stages.simulate_motions', run_name='__main__')\n"
    words = [sys.executable, "-c", WITHOUT + stage, "--root", str(folder)]
    return layout, subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("engines", "message"),
    [
        ({}, "inverse_dynamics: Pinocchio is not installed or cannot be loaded here; allowed: recursion"),
        (
            {"inverse_dynamics": "recursion"},
            "time_laws: Ruckig is not installed or cannot be loaded here; allowed: closed_form",
        ),
    ],
)
def test_a_missing_engine_is_one_sentence_with_its_parameter(done, tmp_path, engines, message):
    _, ended = simulate_without_packages(done, tmp_path, **engines)
    assert (ended.returncode, ended.stderr) == (2, f"simulate_motions: simulate_motions.{message}\n")
    assert sorted(path.name for path in tmp_path.rglob("*.*")) == ["params.yaml", "trees.parquet"]


def test_own_engines_need_no_package_and_agree(done, tmp_path):
    layout, ended = simulate_without_packages(done, tmp_path, inverse_dynamics="recursion", time_laws="closed_form")
    assert ended.returncode == 0, ended.stderr
    own, expected = (pq.read_table(one.runs) for one in (layout, done[1]))
    for name in ("duration_s", "energy_j"):
        assert own[name].to_numpy() == pytest.approx(expected[name].to_numpy(), rel=1e-9)
    assert not np.array_equal(own["energy_j"].to_numpy(), expected["energy_j"].to_numpy())


def test_finished_shards_of_a_run_that_was_killed_are_not_made_again(done, tmp_path, capfd):
    """What such a run leaves: a shard, half of another, the results of the run before (tests/chaos kills real ones)."""
    params, layout = done
    again = Layout(tmp_path)
    generate_trees(params, again)
    again.samples_dir.mkdir(parents=True)
    (again.samples_dir / "part-0099.parquet").write_bytes(b"of the run before")
    made = again.scratch_dir / "simulate_motions"
    shards = planned_shards(params.robot, params.simulate_motions, read_motions(again.trees, 6), made)
    shards[1].make()
    shards[2].make()
    shards[2].table("paths").rename(shards[2].folder / ".begun.arrow")
    written = shards[1].samples.stat().st_mtime_ns
    shards[1].make()
    assert shards[1].samples.stat().st_mtime_ns == written
    assert [path.name for path in again.samples_dir.iterdir()] == ["part-0099.parquet"]

    capfd.readouterr()
    simulate_motions(params, again)
    assert "1 of 3 shards are there already" in capfd.readouterr().out
    for name in ("motions", "runs", "paths"):
        assert getattr(again, name).read_bytes() == getattr(layout, name).read_bytes()
    assert [path.name for path in sorted(again.samples_dir.iterdir())] == [f"part-000{i}.parquet" for i in range(3)]
    for path in layout.samples_dir.iterdir():
        assert (again.samples_dir / path.name).read_bytes() == path.read_bytes()
    assert list(made.iterdir()) == []
    assert {path.name for path in again.data_dir.iterdir()} == {path.name for path in layout.data_dir.iterdir()}


def test_shards_of_other_parameters_are_not_taken(done, tmp_path):
    params, layout = done
    motions = read_motions(layout.trees, 6)
    other = params.simulate_motions.model_copy(update={"sample_rate_hz": 500.0})
    heavier = params.robot.model_copy(update={"payload_kg": 11.0})
    asked = [(params.robot, params.simulate_motions, motions), (params.robot, other, motions)]
    asked += [
        (heavier, params.simulate_motions, motions),
        (params.robot, params.simulate_motions, motions.rows(slice(30))),
    ]
    folders = [planned_shards(*one, tmp_path)[0].folder for one in asked]
    assert len(set(folders)) == 4
    assert planned_shards(*asked[0], tmp_path)[0].folder == folders[0]


def test_workers_end_with_a_run_that_is_killed(tmp_path):
    code = """
import os, sys, time
from reproduction.pools import worker_pool
if __name__ == "__main__":
    with worker_pool(2) as pool:
        print(*{pool.submit(os.getpid).result() for _ in range(20)}, flush=True)
        time.sleep(60)
"""
    (tmp_path / "run.py").write_text(code, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    words = [sys.executable, str(tmp_path / "run.py")]
    with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True) as process:
        workers = [int(pid) for pid in process.stdout.readline().split()]
        process.kill()
    assert workers
    wait_for("end of the workers", lambda: not any(Path(f"/proc/{pid}").exists() for pid in workers), 30)
