"""The thesis's random forest and neural network; all predictors compared on held-out trees and recorded in MLflow."""

from __future__ import annotations

from collections.abc import Callable

from reproduction.claims import write_claims
from reproduction.config import Params, load_params
from reproduction.layout import Layout
from reproduction.predictors.claims import predictor_claims
from reproduction.predictors.comparison import Comparison, compare
from reproduction.predictors.predictor_file import save_predictor
from reproduction.predictors.training import fit_models, read_features, read_profile_predictions
from reproduction.tables import write_csv, write_parquet
from reproduction.tracking.store import RecordError
from reproduction.tracking.trainings import TrainingRecord
from robojoule.documents import read_document, write_document
from stages.cli import run, say


def train_predictors(params: Params, layout: Layout) -> None:
    """Train on the training trees, predict the held-out motions, compare with the profile predictor; record all."""
    progress, record = say("train_predictors"), TrainingRecord(params, layout)
    found = train_and_compare(params, layout, before_fits=record.open)
    try:
        for line in record.write(found):
            progress(line)
    except RecordError as error:  # what was trained is kept
        progress(str(error))


def train_and_compare(params: Params, layout: Layout, before_fits: Callable[[], None] = lambda: None) -> Comparison:
    """All of the stage but the record: write the models, their predictions, Table 5.1, claims and metrics."""
    features = read_features(layout.features)
    profiles = read_profile_predictions(layout.profile_predictions, features)
    profile_metrics = read_document(layout.metrics_dir / "profile_predictor.json")
    before_fits()
    trainings = fit_models(params.train_predictors, features)
    found = compare(features, trainings, profiles, profile_metrics)
    for training in trainings:
        save_predictor(training.predictor, layout.models_dir / training.model)
    write_parquet(layout.predictions, found.predictions)
    write_csv(layout.tables_dir / "table_5_1.csv", found.errors)
    write_csv(layout.tables_dir / "suitability.csv", found.order)
    write_claims(layout.predictor_claims, predictor_claims(found.predictions, found.metrics))
    write_document(layout.metrics_dir / "predictors.json", found.metrics)
    return found


if __name__ == "__main__":
    run(train_predictors, load_params)
