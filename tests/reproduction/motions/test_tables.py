"""Tables of simulated motions against the simulation itself."""

import duckdb
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from reproduction.motions.tables import (
    SAMPLES_SCHEMA,
    motions_of_trees,
    motions_table,
    paths_table,
    runs_table,
    write_samples,
)
from robojoule.motion.simulation import MotionPaths
from tests.core_cases import SPEED_LIMITS, kr16, random_motions


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Seven motions (the last two without length) of two trees, written as the pipeline writes them."""
    folder = tmp_path_factory.mktemp("data")
    robot = kr16()
    points = random_motions(robot, 8)[0]
    points[7] = points[6]
    trees = pa.table(
        {
            "tree_id": ["a"] * 4 + ["b"] * 5,
            "split": ["train"] * 4 + ["test"] * 5,
            "point": pa.array([0, 1, 2, 3, 0, 1, 2, 3, 4], pa.int32()),
            **{f"q{j + 1}_rad": np.append(points[:, j], points[7, j]) for j in range(6)},
        }
    )
    motions = motions_of_trees(trees.take([4, 0, 1, 8, 2, 3, 5, 6, 7]))
    paths = MotionPaths(robot, motions.start_rad, motions.end_rad)
    runs = paths.simulate(SPEED_LIMITS)
    tables = {
        "motions": motions_table(motions, paths),
        "runs": runs_table(motions.motion_id, runs),
        "paths": paths_table(motions.motion_id, paths),
    }
    for name, table in tables.items():
        pq.write_table(table, folder / f"{name}.parquet")
    write_samples(folder / "samples.parquet", motions.motion_id, paths, SPEED_LIMITS, 250.0)
    return folder, motions, paths, runs


def test_motions_connect_consecutive_points_within_a_tree(data):
    _, motions, _, _ = data
    assert motions.tree_id == ["a"] * 3 + ["b"] * 4
    assert motions.split == ["train"] * 3 + ["test"] * 4
    assert motions.order.tolist() == [1, 2, 3, 1, 2, 3, 4]
    assert np.array_equal(motions.end_rad[:2], motions.start_rad[1:3])


def test_runs_mark_speed_limits_that_give_the_same_run(data):
    folder, _, _, runs = data
    table = pq.read_table(folder / "runs.parquet").to_pandas()
    assert table["speed_limit_percent"].tolist() == [10, 20, 30, 40, 50, 60, 70, 80, 90, 100] * 7
    kept = table[table["distinct"]].groupby("motion_id")["duration_s"].nunique()
    assert kept.tolist() == [len(np.unique(row.round(9))) for row in runs.duration_s]


def test_samples_have_the_contracts_columns_and_end_with_the_run(data):
    folder, _, _, runs = data
    table = pq.read_table(folder / "samples.parquet")
    assert table.schema.equals(SAMPLES_SCHEMA)
    frame = table.to_pandas()
    last = frame.groupby(["motion_id", "speed_limit_percent"]).last()
    assert last["time_s"].to_numpy() == pytest.approx(runs.duration_s.ravel(), abs=1e-6)
    assert last["path_position"].to_numpy()[:50] == pytest.approx(1.0, abs=1e-6)
    steps = frame.groupby(["motion_id", "speed_limit_percent"])["time_s"].diff().dropna()
    assert steps.between(0.0, 0.004 + 1e-6, inclusive="neither").all()


def test_samples_integrate_to_the_runs_energies(data):
    folder, _, _, runs = data
    frame = pq.read_table(folder / "samples.parquet").to_pandas()
    for motion in range(5):
        for column, percent in enumerate(SPEED_LIMITS * 100):
            run = frame[(frame.motion_id == motion) & (frame.speed_limit_percent.round(3) == round(percent, 3))]
            energy = np.trapezoid(run["power_w"].astype(float), run["time_s"].astype(float))
            assert energy == pytest.approx(runs.energy_j[motion, column], rel=2e-3)


def test_sql_view_gives_joint_positions_and_torques(data):
    """The view over path coordinates and Chebyshev coefficients equals the simulation's own samples."""
    from importlib import resources

    folder, _, paths, _ = data
    connection = duckdb.connect()
    for name in ("samples", "motions", "paths"):
        connection.execute(f"CREATE VIEW {name} AS SELECT * FROM '{folder / name}.parquet'")
    connection.execute((resources.files("reproduction.features") / "samples.sql").read_text())
    for motion, percent in ((0, 100), (4, 30)):
        frame = connection.execute(
            "SELECT * FROM joint_samples WHERE motion_id = ? AND speed_limit_percent = ? ORDER BY time_s",
            [motion, percent],
        ).df()
        samples = paths.sample(motion, percent / 100.0)
        scale = paths.robot.effort_nm
        for j in range(6):
            position = paths.start_rad[motion, j] + samples.path_position * paths.delta_rad[motion, j]
            assert frame[f"q{j + 1}_rad"].to_numpy() == pytest.approx(position, abs=1e-5)
            velocity = samples.path_velocity_per_s * paths.delta_rad[motion, j]
            assert frame[f"q{j + 1}_velocity_rad_s"].to_numpy() == pytest.approx(velocity, abs=1e-4)
            assert frame[f"q{j + 1}_torque_nm"].to_numpy() == pytest.approx(
                samples.torque_nm[:, j], abs=2e-4 * scale[j]
            )


def test_same_input_gives_the_same_bytes(data, tmp_path):
    folder, motions, paths, _ = data
    write_samples(tmp_path / "again.parquet", motions.motion_id, paths, SPEED_LIMITS, 250.0)
    assert (tmp_path / "again.parquet").read_bytes() == (folder / "samples.parquet").read_bytes()
