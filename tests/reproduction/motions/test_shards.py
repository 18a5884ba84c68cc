"""Sets of random motions by shards: what they hold, and how a folder is claimed and gone on with."""

import json
import subprocess
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest

from reproduction.motions.shards import MotionSet, ShardFolder, close_folder, open_folder, random_motions, write_shard
from robojoule.documents import parse
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import catalog_path
from tests.core_cases import kr16

DESCRIPTION = {
    "robot": {"name": "kuka_kr16_r2010_2", "payload_kg": 10.0, "payload_com_m": [0.0, 0.0, 0.1]},
    "seed": 7,
    "motions": 50,
    "shard_motions": 20,
    "speed_limits_percent": [10, 55, 100],
}


def motion_set(**changes) -> MotionSet:
    return parse(MotionSet, {**DESCRIPTION, **changes}, "test")


def make(description: MotionSet, root):
    for shard in open_folder(description, root):
        write_shard(description, root, shard)
    return close_folder(description, root)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    root = tmp_path_factory.mktemp("set") / "motions of a robot"
    return root, make(motion_set(), root)


def joints(table, end):
    return np.column_stack([table[f"{end}_q{j + 1}_rad"].to_numpy() for j in range(6)])


def test_every_motion_has_its_runs(made):
    root, manifest = made
    assert [entry["rows"] for entry in manifest["shards"]] == [20, 60, 20, 60, 10, 30]
    assert pq.read_table(root / "motions")["motion_id"].to_pylist() == list(range(50))
    runs = pq.read_table(root / "runs")
    assert runs["motion_id"].to_pylist() == [motion for motion in range(50) for _ in range(3)]
    assert runs["speed_limit_percent"].to_pylist() == [10.0, 55.0, 100.0] * 50


def test_runs_are_those_of_the_simulation(made):
    root, _ = made
    motions, runs = (pq.read_table(root / name) for name in ("motions", "runs"))
    expected = MotionPaths(kr16(), joints(motions, "start"), joints(motions, "end")).simulate([0.1, 0.55, 1.0])
    for name in ("duration_s", "energy_j"):
        assert runs[name].to_numpy() == pytest.approx(getattr(expected, name).ravel(), rel=1e-9)


def test_motions_keep_limits_and_budget(made):
    root, _ = made
    motions, robot = pq.read_table(root / "motions"), kr16()
    start, end = joints(motions, "start"), joints(motions, "end")
    for q in (start, end):
        assert (q >= robot.lower_rad).all() and (q <= robot.upper_rad).all()
    change = np.abs(end - start).sum(axis=1)
    inside = ((end > robot.lower_rad) & (end < robot.upper_rad)).all(axis=1)
    assert change.max() <= 4.5 + 1e-12 and change[inside].min() >= 2.1 - 1e-12


def test_a_shard_has_the_random_stream_of_its_number(made):
    root, _ = made
    stream = np.random.SeedSequence(7).spawn(3)[1]
    start, end = random_motions(kr16(), np.random.default_rng(stream), 20, (2.1, 4.5))
    second = pq.read_table(ShardFolder(root).motions(1))
    assert np.array_equal(joints(second, "start"), start)
    assert np.array_equal(joints(second, "end"), end)


def test_a_shard_does_not_depend_on_the_others(made, tmp_path):
    root, _ = made
    longer = motion_set(motions=1000)
    open_folder(longer, tmp_path)
    write_shard(longer, tmp_path, 1)
    for file in (ShardFolder.motions, ShardFolder.runs):
        assert file(ShardFolder(tmp_path), 1).read_bytes() == file(ShardFolder(root), 1).read_bytes()


def test_what_is_missing_broken_or_half_written_is_made_again(made, tmp_path):
    _, manifest = made
    folder = ShardFolder(tmp_path)
    make(motion_set(), tmp_path)
    assert open_folder(motion_set(), tmp_path) == []
    folder.motions(0).unlink()
    whole = folder.runs(2).read_bytes()
    folder.runs(2).write_bytes(whole[: len(whole) // 2])
    killed = "import os, sys; from robojoule.documents import atomic_path\nwith atomic_path(sys.argv[1]): os._exit(9)"
    subprocess.run([sys.executable, "-c", killed, str(folder.runs(1))], check=False)
    assert len(list(folder.runs(0).parent.iterdir())) == 4  # a pattern of DuckDB takes what it left as well
    assert open_folder(motion_set(), tmp_path) == [0, 2]
    with pytest.raises(InputError, match="shard 0 is missing"):
        close_folder(motion_set(), tmp_path)
    assert make(motion_set(), tmp_path) == manifest
    assert sorted(p.name for p in folder.runs(0).parent.iterdir()) == [f"part-0000{i}.parquet" for i in range(3)]


def test_a_set_has_the_payloads_own_inertia(made, tmp_path):
    root, _ = made
    inertia = [0.5, 0.5, 0.5, 0.0, 0.0, 0.0]
    make(motion_set(robot={**DESCRIPTION["robot"], "payload_inertia_kg_m2": inertia}), tmp_path)
    energies = [pq.read_table(folder / "runs")["energy_j"].to_numpy() for folder in (root, tmp_path)]
    assert not np.allclose(*energies, rtol=1e-4)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("robot", {"name": "kuka_kr16_r2010_2", "payload_kg": 9.0, "payload_com_m": [0.0, 0.0, 0.1]}),
        ("seed", 8),
        ("motions", 51),
        ("shard_motions", 25),
        ("budget_rad", [2.1, 4.4]),
        ("speed_limits_percent", [10, 100]),
    ],
)
def test_a_folder_holds_one_set(made, key, value):
    root, _ = made
    with pytest.raises(InputError, match=rf"manifest\.json, {key}: the folder holds a set with {key}"):
        open_folder(motion_set(**{key: value}), root)


def test_a_set_is_of_a_robots_figures_not_of_its_name(tmp_path):
    path = tmp_path / "arm.json"
    figures = json.loads(catalog_path("kuka_kr16_r2010_2").read_text(encoding="utf-8"))
    robot = {**DESCRIPTION["robot"], "name": str(path)}
    path.write_text(json.dumps(figures), encoding="utf-8")
    open_folder(motion_set(robot=robot), tmp_path / "set")
    figures["drives"]["base_power_w"] += 1.0
    path.write_text(json.dumps(figures), encoding="utf-8")
    with pytest.raises(InputError, match="robot_sha256"):
        open_folder(motion_set(robot=robot), tmp_path / "set")


def test_other_folders_are_left_alone(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="not the folder of a motion set"):
        open_folder(motion_set(), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"motions": 0}, "motions: input should be greater than or equal to 1"),
        ({"budget_rad": [3.0, 2.0]}, "budget_rad must be two positive numbers in rising order"),
        ({"speed_limits_percent": [50, 20]}, "speed_limits_percent must rise strictly"),
        ({"speed_limits_percent": [101]}, "speed_limits_percent.0: input should be less than or equal to 100"),
        ({"shards": 3}, "shards: unknown key; allowed: budget_rad, motions, robot, seed, shard_motions"),
    ],
)
def test_bad_descriptions_are_named(changes, message):
    with pytest.raises(InputError) as caught:
        motion_set(**changes)
    assert message in str(caught.value)
