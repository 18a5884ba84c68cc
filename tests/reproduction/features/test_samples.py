"""The view of joint samples for arms of any number of joints."""

import duckdb
import numpy as np
import pyarrow as pa
import pytest

from reproduction import features
from reproduction.motions.tables import motions_of_trees, motions_table, paths_table, write_samples
from robojoule.motion.dynamics import inverse_dynamics
from robojoule.motion.simulation import MotionPaths
from robojoule.robots.robot import Robot
from tests.robots.arms import arm_file

QUANTITIES = ("rad", "velocity_rad_s", "acceleration_rad_s2", "jerk_rad_s3", "torque_nm")


@pytest.mark.parametrize("joints", [1, 2, 7, 11])
def test_every_joint_of_an_arm_has_its_samples(tmp_path, joints):
    """Positions lie between both ends; torques are inverse dynamics, friction and rotor at the view's own motion."""
    robot = Robot(arm_file(joints))
    points = np.random.default_rng(joints).uniform(-0.8, 0.8, (3, joints))
    columns = {f"q{j + 1}_rad": points[:, j] for j in range(joints)}
    order = pa.array([0, 1, 2], pa.int32())
    motions = motions_of_trees(pa.table({"tree_id": ["a"] * 3, "split": ["train"] * 3, "point": order, **columns}))
    paths = MotionPaths(robot, motions.start_rad, motions.end_rad)
    write_samples(tmp_path / "samples.parquet", motions.motion_id, paths, np.array([0.5, 1.0]), 250.0)
    connection = duckdb.connect()
    connection.read_parquet(str(tmp_path / "samples.parquet")).create_view("samples")
    connection.from_arrow(motions_table(motions, paths)).create_view("motions")
    connection.from_arrow(paths_table(motions.motion_id, paths)).create_view("paths")
    connection.execute(features.sql("samples"))
    frame = connection.execute(
        "SELECT * FROM joint_samples WHERE motion_id = 1 AND speed_limit_percent = 50 ORDER BY time_s"
    ).fetchnumpy()
    named = [f"q{j + 1}_{quantity}" for quantity in QUANTITIES for j in range(joints)]
    assert set(frame) == {"motion_id", "speed_limit_percent", "time_s", "power_w", *named}
    position, velocity, acceleration, _, torque = (
        np.column_stack([frame[f"q{j + 1}_{quantity}"] for j in range(joints)]) for quantity in QUANTITIES
    )
    assert position[0] == pytest.approx(points[1], abs=1e-6)
    assert position[-1] == pytest.approx(points[2], abs=1e-6)
    drives, sense = robot.drives, np.sign(points[2] - points[1])
    expected = inverse_dynamics(robot, position, velocity, acceleration)
    expected += drives.gear_ratio**2 * drives.rotor_inertia_kg_m2 * acceleration
    expected += drives.coulomb_nm * sense + drives.viscous_nm_s_per_rad * velocity
    assert torque[1:-1] == pytest.approx(expected[1:-1], abs=1e-3 * robot.effort_nm[0])
