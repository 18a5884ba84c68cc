"""Logs by the names of a Universal Robots controller."""

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import csv

import robojoule as rj
from robojoule.calibration.log import read_log
from robojoule.errors import InputError
from robojoule.robots import load_robot

N = 600
ROBOT = "ur_ur5e"


def columns():
    time = 1700.0 + np.arange(N) * 0.008
    table = {"timestamp": time}
    home = load_robot(ROBOT).home_rad
    for joint in range(6):
        table[f"actual_q_{joint}"] = home[joint] + 0.3 * np.sin(1.5 * (time - time[0]) + joint)
        table[f"actual_qd_{joint}"] = 0.45 * np.cos(1.5 * (time - time[0]) + joint)
        table[f"actual_current_{joint}"] = 0.5 * np.cos(time)
    table["actual_robot_voltage"] = np.full(N, 48.0)
    table["actual_robot_current"] = 1.0 + 0.2 * np.sin(time)
    table["target_speed_fraction"] = np.full(N, 0.5)
    table["robot_mode"] = np.full(N, 7)
    return table


def saved(tmp_path, table):
    csv.write_csv(pa.table(table), tmp_path / "rtde.csv")
    return tmp_path / "rtde.csv"


def test_positions_power_and_slider_are_read(tmp_path):
    table, robot = columns(), load_robot(ROBOT)
    log = read_log(saved(tmp_path, table), robot)
    assert log.on_the_arm
    assert log.power_w == pytest.approx(48.0 * table["actual_robot_current"])
    assert log.position_rad[:, 2] == pytest.approx(table["actual_q_2"])
    assert log.velocity_rad_s[:, 5] == pytest.approx(table["actual_qd_5"])
    assert log.speed_limit == pytest.approx(0.5)
    assert log.torque_nm is None  # currents come in every such log: without torque constants they are left out


def test_currents_become_torques_with_torque_constants(tmp_path):
    table, robot = columns(), load_robot(ROBOT)
    log = read_log(saved(tmp_path, table), robot, [0.1] * 6)
    assert log.torque_nm[:, 0] == pytest.approx(0.1 * robot.drives.gear_ratio[0] * table["actual_current_0"])


def test_packets_that_came_twice_count_once(tmp_path):
    table = columns()
    twice = {name: np.repeat(values, np.where(np.arange(N) % 7 == 3, 2, 1)) for name, values in table.items()}
    log = read_log(saved(tmp_path, twice), load_robot(ROBOT))
    assert log.time_s == pytest.approx(table["timestamp"])
    assert log.power_w == pytest.approx(48.0 * table["actual_robot_current"])


def test_power_of_the_arm_is_not_taken_for_that_of_the_mains(tmp_path):
    with pytest.raises(InputError, match=r"power_side: the power of this log is that of the bus.*allowed: arm"):
        rj.identify(saved(tmp_path, columns()), load_robot(ROBOT))


def test_a_table_that_blanks_separate_is_read(tmp_path):
    table = columns()
    rows = [" ".join(table), *(" ".join(f"{value:.9g}" for value in row) for row in zip(*table.values(), strict=True))]
    (tmp_path / "rtde.txt").write_text("\n".join(rows) + "\n", encoding="utf-8")
    log = read_log(tmp_path / "rtde.txt", load_robot(ROBOT))
    assert log.power_w == pytest.approx(48.0 * table["actual_robot_current"])
