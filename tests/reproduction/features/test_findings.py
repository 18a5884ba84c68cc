"""Correlations, the forward and reverse comparison, and the claims, against numpy."""

from __future__ import annotations

import duckdb
import numpy as np
import pyarrow as pa
import pytest

from reproduction import features
from tests.reproduction.features.synthetic import DataSet, make


@pytest.fixture(scope="module")
def data() -> DataSet:
    return make(trees=8, motions_per_tree=6, experiment=2)


@pytest.fixture(scope="module")
def connection(data: DataSet) -> duckdb.DuckDBPyConnection:
    connection = features.connect(data.motions, data.samples, data.runs)
    features.build(connection, (*features.FEATURE_TABLES, *features.FINDING_TABLES))
    return connection


def analysed(connection: duckdb.DuckDBPyConnection) -> pa.Table:
    return features.fetch(connection, "features").filter(pa.compute.field("split") != "experiment")


def test_correlations_equal_numpy(connection: duckdb.DuckDBPyConnection) -> None:
    table = analysed(connection)
    rows = features.fetch(connection, "correlations").to_pylist()
    assert {row["block"] for row in rows} == {"static", "dynamic_1_3", "dynamic_4_6"}
    for row in rows:
        with np.errstate(invalid="ignore", divide="ignore"):
            expected = np.corrcoef(table[row["row_feature"]].to_numpy(), table[row["column_feature"]].to_numpy())[0, 1]
        if row["row_feature"] == row["column_feature"]:
            expected = 1.0
        if np.isfinite(expected):
            assert row["pearson"] == pytest.approx(expected, abs=1e-6)
        else:
            assert row["pearson"] is None


def test_correlation_blocks_are_square_and_hold_the_figures_features(connection: duckdb.DuckDBPyConnection) -> None:
    rows = features.fetch(connection, "correlations").to_pylist()
    sizes = {"static": 8 + 5 + 6 - 1, "dynamic_1_3": 4 + 15, "dynamic_4_6": 4 + 15}
    for block, size in sizes.items():
        pairs = [(row["row_feature"], row["column_feature"]) for row in rows if row["block"] == block]
        assert len(pairs) == len(set(pairs)) == size**2, block
    static = {row["row_feature"] for row in rows if row["block"] == "static"}
    assert {"theta_sum_rad", "euclidean_distance_m", "j6_angle_difference_rad", "duration_penalty_s"} <= static


def test_retrace_pairs_the_first_motion_with_the_last(data: DataSet, connection: duckdb.DuckDBPyConnection) -> None:
    table = analysed(connection)
    rows = {row["quantity"]: row for row in features.fetch(connection, "retrace").to_pylist()}
    assert list(rows) == ["energy_saving_j", "optimal_duration_s", "energy_penalty_j", "duration_fastest_s"]
    rise = (data.motions["end_z_m"].to_numpy() - data.motions["start_z_m"].to_numpy())[: len(table)]
    for name, row in rows.items():
        values = table[name].to_numpy().reshape(-1, 6)
        forward, reverse = values[:, :3].ravel(), values[:, :2:-1].ravel()
        difference = reverse - forward
        assert row["pairs"] == len(forward) == 18
        assert row["mean_forward"] == pytest.approx(forward.mean(), abs=1e-6)
        assert row["mean_reverse"] == pytest.approx(reverse.mean(), abs=1e-6)
        assert row["mean_difference"] == pytest.approx(difference.mean(), abs=1e-6)
        assert row["pearson"] == pytest.approx(np.corrcoef(forward, reverse)[0, 1], abs=1e-6)
        assert row["pearson_with_rise"] == pytest.approx(
            np.corrcoef(difference, rise.reshape(-1, 6)[:, :3].ravel())[0, 1], abs=1e-6
        )
        quantiles = np.quantile(np.abs(difference), [0.25, 0.5, 0.75, 1])
        for column, expected in zip(("p25", "p50", "p75", "max"), quantiles, strict=True):
            assert row[f"abs_difference_{column}"] == pytest.approx(expected, abs=1e-6)


def test_claims_state_what_was_found(connection: duckdb.DuckDBPyConnection) -> None:
    claims = features.fetch(connection, "claims_features").to_pylist()
    assert len(claims) == 14
    assert all(row["thesis"] and row["robojoule"] and isinstance(row["held"], bool) for row in claims)
    table = analysed(connection)
    saving = table["energy_saving_j"].to_numpy()
    signs = [np.corrcoef(saving, table[f"j{j}_angle_difference_rad"].to_numpy())[0, 1] for j in (1, 2, 3)]
    by_text = {row["claim"]: row for row in claims}
    row = by_text["Angle differences of joints 1-3 correlate with the energy saving"]
    assert row["held"] == (min(signs) > 0)
    assert row["robojoule"] == f"{min(signs):.2f} to {max(signs):.2f}"
    strongest = by_text["Of the angle differences of joints 1-3 the strongest is"]
    assert strongest["robojoule"] == f"j{1 + int(np.argmax(np.abs(signs)))}"


def test_straight_rising_segment_is_recognised(data: DataSet) -> None:
    duration = data.runs["duration_s"].to_numpy()
    runs = data.runs.set_column(3, "energy_j", pa.array(np.abs(duration - 0.6) * 500))
    connection = features.connect(data.motions, data.samples, runs)
    features.build(connection, (*features.FEATURE_TABLES, *features.FINDING_TABLES))
    row = features.fetch(connection, "claims_features").to_pylist()[-1]
    assert row["held"] is True
    assert row["robojoule"].startswith("median 1.0000")
