"""The record of the cross-validation: the whole, below it each model, below that each fold."""

from pathlib import Path

import pytest

from reproduction.layout import Layout
from reproduction.study.comparison import Comparison
from reproduction.tables import table_of_rows, write_csv, write_parquet
from reproduction.tracking import study as tracking
from reproduction.tracking.store import STUDY, connect, data_hash
from tests.reproduction.study.cases import small_study

MODELS = ("mean", "random_forest")


def error(model: str, figure: float, **key: object) -> dict[str, object]:
    return {**key, "model": model, "target": "energy_saving_j", "rel_p50_percent": figure, "motions": 4}


def test_every_fold_has_a_run_with_its_errors_and_what_it_chose(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    layout, params = Layout(tmp_path), small_study()
    found = Comparison(
        rows=[error(model, 10.0) for model in MODELS],
        fold_rows=[error(model, 9.0 + fold, fold=fold) for model in MODELS for fold in (1, 2)],
        chosen={"mean": [{}, {}], "random_forest": [{"min_samples_leaf": 1}, {"min_samples_leaf": 3}]},
        metrics={"random_forest": {"coverage_percent": 90.0}},
    )
    write_csv(layout.study_tables_dir / "predictors.csv", found.rows)
    write_parquet(layout.study_data_dir / "predictors.parquet", table_of_rows([{"motion": 1}]))
    (tmp_path / "studies/dvc.lock").write_text("schema: '2.0'\n", encoding="utf-8")
    monkeypatch.setenv("DVC_EXP_NAME", "wide-forests")
    mlflow = connect(layout, STUDY)
    tracking.record(mlflow, layout, params, found)

    runs = mlflow.search_runs(experiment_names=[STUDY], output_format="list")
    by_name = {run.info.run_name: run for run in runs}
    assert set(by_name) == {
        "nested cross-validation",
        *MODELS,
        *(f"{model}, fold {fold}" for model in MODELS for fold in (1, 2)),
    }
    for name, run in by_name.items():
        above = {"nested cross-validation": None, **dict.fromkeys(MODELS, "nested cross-validation")}
        parent = above.get(name, name.split(",")[0])
        assert run.data.tags.get("mlflow.parentRunId") == (by_name[parent].info.run_id if parent else None)
        assert {"git_commit", "config_hash", "lock_hash", "dvc_stage", "dvc_experiment"} <= set(run.data.tags)
    second = by_name["random_forest, fold 2"]
    assert second.data.metrics == {"predictors.energy_saving_j.random_forest.rel_p50_percent": 11.0}
    assert second.data.params["min_samples_leaf"] == "3"
    assert by_name["random_forest"].data.metrics["predictors.interval.random_forest.coverage_percent"] == 90.0
    (data,) = by_name["nested cross-validation"].inputs.dataset_inputs
    assert data.dataset.digest == data_hash(layout.study_data_dir / "predictors.parquet")
