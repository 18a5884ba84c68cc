from __future__ import annotations

import csv
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from reproduction.config import load_params
from reproduction.layout import Layout
from robojoule.errors import InputError
from stages.build_features import build_features
from tests.reproduction.features.synthetic import make

PARAMS = load_params(Path(__file__).parents[2] / "params.yaml")
OUTPUTS = (
    "data/features.parquet",
    "reports/tables/correlations.csv",
    "reports/tables/retrace.csv",
    "reports/claims/features.csv",
)


def test_writes_its_outputs_with_the_same_bytes_twice(tmp_path: Path) -> None:
    layout = Layout(tmp_path)
    make().write(layout.data_dir)
    build_features(PARAMS, layout)
    first = {name: (tmp_path / name).read_bytes() for name in OUTPUTS}
    build_features(PARAMS, layout)
    assert {name: (tmp_path / name).read_bytes() for name in OUTPUTS} == first
    assert pq.read_table(layout.features).num_rows == 16
    with (layout.tables_dir / "correlations.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["block", "row_feature", "column_feature", "pearson"]
    with layout.feature_claims.open(encoding="utf-8") as file:
        assert {row["held"] for row in csv.DictReader(file)} <= {"true", "false"}
    assert not list(tmp_path.rglob(".*"))


def test_how_the_samples_are_split_into_files_does_not_matter(tmp_path: Path) -> None:
    for shards in (1, 3):
        make().write(tmp_path / str(shards) / "data", shards)
        build_features(PARAMS, Layout(tmp_path / str(shards)))
    for name in OUTPUTS:
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "3" / name).read_bytes()


def test_missing_input_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"motions\.parquet"):
        build_features(PARAMS, Layout(tmp_path))
    assert not list(tmp_path.rglob("*"))
