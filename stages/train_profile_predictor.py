"""The predictor of whole profiles: fitted to training trees, read back, tried on held-out trees."""

from __future__ import annotations

from reproduction.config import Params, load_params
from reproduction.layout import Layout
from reproduction.profile_predictor.training import MODEL, predict_held_out, train
from reproduction.tables import write_parquet
from robojoule.documents import write_document
from robojoule.profile.predictor_file import load_profile_predictor, save_profile_predictor
from stages.cli import run, say


def train_profile_predictor(params: Params, layout: Layout) -> None:
    """Write models/profile_predictor and what it predicts for the held-out motions."""
    progress = say("train_profile_predictor")
    robot = params.robot.robot()
    predictor = train(robot, params.train_profile_predictor, layout.motions, layout.runs)
    progress(predictor.note)
    save_profile_predictor(predictor, layout.profile_predictor)
    # Tried as others get it: from its files.
    predictor = load_profile_predictor(layout.profile_predictor)
    predictions, interval = predict_held_out(predictor, robot, layout.motions, layout.runs)
    write_parquet(layout.profile_predictions, predictions)
    write_document(layout.metrics_dir / "profile_predictor.json", {"interval": {MODEL: interval}})
    progress(f"{interval['coverage_percent']:g} % of the test runs are inside the prediction interval")


if __name__ == "__main__":
    run(train_profile_predictor, load_params)
