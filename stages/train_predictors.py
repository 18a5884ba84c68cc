"""The thesis's random forest and neural network; all predictors compared on held-out trees and recorded in MLflow."""

from __future__ import annotations

import pyarrow as pa

from reproduction.claims import write_claims
from reproduction.config import Params, load_params
from reproduction.layout import Layout
from reproduction.predictors.claims import predictor_claims
from reproduction.predictors.comparison import compare
from reproduction.predictors.predictor_file import save_predictor
from reproduction.predictors.training import fit_models, predictions, read_features, read_profile_predictions
from reproduction.tables import write_csv, write_parquet
from reproduction.tracking.trainings import record_trainings
from robojoule.documents import read_document, write_document
from stages.cli import run, say


def train_predictors(params: Params, layout: Layout) -> None:
    """Train on the training trees, predict the held-out motions, and compare with the profile predictor."""
    progress = say("train_predictors")
    features = read_features(layout.features)
    profiles = read_profile_predictions(layout.profile_predictions, features)
    trainings = fit_models(params.train_predictors, features)
    for training in trainings:
        save_predictor(training.predictor, layout.models_dir / training.model)
        progress(f"{training.model}, fitted in {training.fit_s:.1f} s")
    tables = [predictions(training, features) for training in trainings]
    found = pa.concat_tables([*tables, profiles.cast(tables[0].schema)])
    errors, order, metrics = compare(found, features)
    metrics |= read_document(layout.metrics_dir / "profile_predictor.json")
    write_parquet(layout.predictions, found)
    write_csv(layout.tables_dir / "table_5_1.csv", errors)
    write_csv(layout.tables_dir / "suitability.csv", order)
    write_claims(layout.predictor_claims, predictor_claims(found, metrics))
    write_document(layout.metrics_dir / "predictors.json", metrics)
    for line in record_trainings(params, layout, trainings, features, found, metrics):
        progress(line)


if __name__ == "__main__":
    run(train_predictors, load_params)
