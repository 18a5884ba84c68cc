from __future__ import annotations

import numpy as np
import pyarrow as pa
import pytest

from reproduction import features
from robojoule.errors import InputError
from tests.reproduction.features.synthetic import FIGURES, LIMITS, DataSet, make

UNITS = {
    "speed": "rad_s",
    "acceleration": "rad_s2",
    "deceleration": "rad_s2",
    "jerk_acceleration": "rad_s3",
    "jerk_deceleration": "rad_s3",
}


def build_table(data: DataSet, tables: tuple[str, ...] = features.FEATURE_TABLES, name: str = "features") -> pa.Table:
    connection = features.connect(data.motions, data.samples, data.runs)
    features.build(connection, tables)
    return features.fetch(connection, name)


def joints(data: DataSet, end: str, count: int = 6) -> np.ndarray:
    return np.column_stack([data.motions[f"{end}_q{j}_rad"].to_numpy() for j in range(1, count + 1)])


def replaced(table: pa.Table, **columns: object) -> pa.Table:
    for name, values in columns.items():
        table = table.set_column(table.column_names.index(name), name, pa.array(values, table[name].type))
    return table


@pytest.fixture(scope="module")
def data() -> DataSet:
    return make()


@pytest.fixture(scope="module")
def table(data: DataSet) -> pa.Table:
    return build_table(data)


def test_columns_are_the_contract(table: pa.Table) -> None:
    expected = [
        "motion_id",
        "tree_id",
        "split",
        "order",
        "optimal_speed_limit_percent",
        "optimal_duration_s",
        "energy_saving_j",
        "energy_penalty_j",
        "duration_slowest_s",
        "duration_fastest_s",
        "duration_penalty_s",
        "steepness_j_per_s",
        "theta_sum_rad",
        "rotation_angle_rad",
        "euclidean_distance_m",
        "vertical_distance_m",
        "horizontal_distance_m",
    ]
    for joint in range(1, 7):
        expected.append(f"j{joint}_angle_difference_rad")
        expected += [f"j{joint}_{figure}_difference_{UNITS[figure]}" for figure in FIGURES]
    assert table.column_names == expected
    assert table["motion_id"].to_pylist() == list(range(16))
    assert all(table[name].null_count == 0 for name in expected)


def test_joint_figures_follow_the_closed_form(data: DataSet, table: pa.Table) -> None:
    travel = np.abs(joints(data, "end") - joints(data, "start"))
    difference = np.array(
        [fast.figures() - slow.figures() for fast, slow in zip(data.fastest, data.slowest, strict=True)]
    )
    for joint in range(6):
        assert table[f"j{joint + 1}_angle_difference_rad"].to_numpy() == pytest.approx(travel[:, joint], abs=1e-15)
        for place, figure in enumerate(FIGURES):
            found = table[f"j{joint + 1}_{figure}_difference_{UNITS[figure]}"].to_numpy()
            assert found == pytest.approx(travel[:, joint] * difference[:, place], rel=1e-5, abs=1e-6)


def test_acceleration_and_deceleration_phase_are_told_apart(table: pa.Table) -> None:
    acceleration = table["j1_acceleration_difference_rad_s2"].to_numpy()
    deceleration = table["j1_deceleration_difference_rad_s2"].to_numpy()
    assert not np.allclose(acceleration, deceleration, rtol=0.01)
    assert (acceleration > 0).all() and (deceleration > 0).all()


def test_geometry(data: DataSet, table: pa.Table) -> None:
    start, end = joints(data, "start"), joints(data, "end")
    step = np.column_stack(
        [data.motions[f"end_{a}_m"].to_numpy() - data.motions[f"start_{a}_m"].to_numpy() for a in "xyz"]
    )
    assert table["theta_sum_rad"].to_numpy() == pytest.approx(np.abs(end - start).sum(axis=1))
    assert table["euclidean_distance_m"].to_numpy() == pytest.approx(np.linalg.norm(step, axis=1))
    assert table["horizontal_distance_m"].to_numpy() == pytest.approx(np.hypot(step[:, 0], step[:, 1]))
    assert table["vertical_distance_m"].to_numpy() == pytest.approx(np.abs(step[:, 2]))
    turn = np.abs((end - start)[:, :2].sum(axis=1)) % (2 * np.pi)  # the axis is fixed: angles simply subtract
    assert table["rotation_angle_rad"].to_numpy() == pytest.approx(np.minimum(turn, 2 * np.pi - turn))


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1.0, np.pi])
@pytest.mark.parametrize("sign", [1, -1], ids=["same sign", "opposite sign"])
def test_rotation_angle_keeps_its_digits(data: DataSet, angle: float, sign: int) -> None:
    count = len(data.motions)
    motions = replaced(
        data.motions,
        **{f"start_q{part}": [float(part == "w")] * count for part in "wxyz"},
        **{f"end_q{part}": [0.0] * count for part in "yz"},
        end_qw=[sign * np.cos(angle / 2)] * count,
        end_qx=[sign * np.sin(angle / 2)] * count,
    )
    connection = features.connect(motions, data.samples, data.runs)
    features.build(connection)
    found = features.fetch(connection, "inputs")["rotation_angle_rad"].to_numpy()
    assert found == pytest.approx(angle, rel=1e-7, abs=1e-12)


def test_measured_optimum(data: DataSet, table: pa.Table) -> None:
    shape = (len(data.motions), len(LIMITS))
    energy = data.runs["energy_j"].to_numpy().reshape(shape)
    duration = data.runs["duration_s"].to_numpy().reshape(shape)
    best = energy.argmin(axis=1)
    rows = np.arange(len(energy))
    saving, delay = energy[:, -1] - energy[rows, best], duration[rows, best] - duration[:, -1]
    assert len(set(best)) > 1
    assert table["optimal_speed_limit_percent"].to_numpy() == pytest.approx(np.array(LIMITS)[best])
    assert table["optimal_duration_s"].to_numpy() == pytest.approx(duration[rows, best])
    assert table["energy_saving_j"].to_numpy() == pytest.approx(saving)
    assert table["energy_penalty_j"].to_numpy() == pytest.approx(energy[:, 0] - energy[rows, best])
    assert table["duration_slowest_s"].to_numpy() == pytest.approx(duration[:, 0])
    assert table["duration_fastest_s"].to_numpy() == pytest.approx(duration[:, -1])
    assert table["duration_penalty_s"].to_numpy() == pytest.approx(delay)
    assert table["steepness_j_per_s"].to_numpy() == pytest.approx(saving / np.where(delay > 0, delay, 1))


def test_fastest_run_optimal_means_no_saving_and_steepness_zero(data: DataSet) -> None:
    runs = replaced(data.runs, energy_j=data.runs["duration_s"].to_numpy() * 430)
    table = build_table(DataSet(data.motions, runs, data.samples, [], []))
    assert set(table["energy_saving_j"].to_pylist()) == {0.0}
    assert set(table["duration_penalty_s"].to_pylist()) == {0.0}
    assert set(table["steepness_j_per_s"].to_pylist()) == {0.0}
    assert set(table["optimal_speed_limit_percent"].to_pylist()) == {100.0}


def test_merged_speed_limits_count_once(data: DataSet) -> None:
    limit = data.runs["speed_limit_percent"].to_numpy()
    runs = replaced(data.runs, distinct=limit <= 70)
    energy = runs["energy_j"].to_numpy().copy()
    energy[limit > 70] -= 1e9  # must not be looked at
    table = build_table(DataSet(data.motions, replaced(runs, energy_j=energy), data.samples, [], []))
    duration = data.runs["duration_s"].to_numpy().reshape(-1, len(LIMITS))
    assert table["duration_fastest_s"].to_numpy() == pytest.approx(duration[:, 6])
    assert max(table["optimal_speed_limit_percent"].to_pylist()) <= 70
    assert min(table["energy_saving_j"].to_pylist()) >= 0


def test_motion_of_length_zero_has_zero_features(data: DataSet) -> None:
    still = {f"end_{n}": data.motions[f"start_{n}"].to_pylist() for n in ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")}
    still |= {f"end_q{j}_rad": data.motions[f"start_q{j}_rad"].to_pylist() for j in range(1, 7)}
    motions = replaced(data.motions, **{k: [v[0], *data.motions[k].to_pylist()[1:]] for k, v in still.items()})
    samples = data.samples.filter(pa.array(data.samples["motion_id"].to_numpy() != 0))
    row = build_table(DataSet(motions, data.runs, samples, [], [])).slice(0, 1).to_pylist()[0]
    inputs = [v for k, v in row.items() if k[0] == "j" or k.endswith(("distance_m", "angle_rad", "sum_rad"))]
    assert inputs == [0.0] * 41


def test_other_joint_counts(data: DataSet) -> None:
    seven = make(trees=2, joints=7)
    names = build_table(seven).column_names
    assert "j7_jerk_deceleration_difference_rad_s3" in names and "j8_angle_difference_rad" not in names


def test_order_of_rows_does_not_change_a_bit(data: DataSet, table: pa.Table) -> None:
    random = np.random.default_rng(0)
    shuffled = DataSet(
        *(part.take(random.permutation(len(part))) for part in (data.motions, data.runs, data.samples)), [], []
    )
    names = (*features.FEATURE_TABLES, *features.FINDING_TABLES)
    for name in ("features", *features.FINDING_TABLES):
        assert build_table(shuffled, names, name).equals(build_table(data, names, name)), name


def test_one_speed_limit_is_refused(data: DataSet) -> None:
    runs = data.runs.filter(pa.array(data.runs["speed_limit_percent"].to_numpy() == 100))
    with pytest.raises(InputError, match="a slowest and a fastest speed limit"):
        features.connect(data.motions, data.samples, runs)
