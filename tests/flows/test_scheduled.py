"""Results that a run which was asked for leaves: a whole folder or none."""

from pathlib import Path

import pytest

from flows.scheduled import KEPT, keep_results


def test_results_appear_when_they_are_complete(tmp_path: Path):
    clone, results = tmp_path / "clone", tmp_path / "results/calm-robin"
    for folder in ("reports/tables", "models"):
        (clone / folder).mkdir(parents=True)
    (clone / "reports/tables/table.csv").write_text("1", encoding="utf-8")
    (clone / "params.yaml").touch()
    with pytest.raises(FileNotFoundError):  # the last one to be copied is not there
        keep_results(clone, results)
    assert not results.exists()
    (clone / "dvc.lock").touch()
    keep_results(clone, results)
    assert {path.name for path in results.iterdir()} == set(KEPT)
    assert (results / "reports/tables/table.csv").read_text(encoding="utf-8") == "1"
    assert [path.name for path in results.parent.iterdir()] == ["calm-robin"]
