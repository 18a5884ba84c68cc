"""Where the files of the pipeline and of the studies are below the root folder: all file names in one place."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


class _Below:
    """A file or folder at a fixed place below the root of a `Layout`."""

    def __init__(self, place: str) -> None:
        self.place = place

    def __get__(self, layout: Layout, owner: type[Layout]) -> Path:
        return layout.root / self.place


@dataclass(frozen=True)
class Layout:
    """Paths of every file that a stage reads or writes, below `root`."""

    root: Path = Path()

    data_dir = _Below("data")  # folder of the Parquet files
    trees = _Below("data/trees.parquet")  # operation trees, one row per point
    trees_dir = _Below("data/trees")  # the experiment trees as operation-tree files
    motions = _Below("data/motions.parquet")  # point-to-point motions, one row per motion
    runs = _Below("data/runs.parquet")  # simulated runs, one row per motion and speed limit
    samples_dir = _Below("data/samples")  # time series of every run, in shards
    paths = _Below("data/paths.parquet")  # Chebyshev coefficients of the path torques, one row per motion
    features = _Below("data/features.parquet")  # features and targets, one row per motion
    predictions = _Below("data/predictions.parquet")  # predicted profile parameters of held-out motions
    profile_predictions = _Below("data/profile_predictions.parquet")  # those of the profile predictor alone
    plans = _Below("data/plans.parquet")  # every plan, one row per vertex
    models_dir = _Below("models")  # fitted predictors, a folder each
    profile_predictor = _Below("models/profile_predictor")  # folder of the predictor of whole profiles
    reports_dir = _Below("reports")  # folder of tables, metrics, figures and the report
    tables_dir = _Below("reports/tables")  # result tables (CSV)
    figures_dir = _Below("reports/figures")  # figures
    claims_dir = _Below("reports/claims")  # claims of single chapters (CSV), joined in `tables_dir`
    feature_claims = _Below("reports/claims/features.csv")  # claims about features (thesis chapter 4)
    predictor_claims = _Below("reports/claims/predictors.csv")  # claims about predictors (thesis chapter 5)
    metrics_dir = _Below("reports/metrics")  # metrics of single stages (JSON), merged into `metrics`
    metrics = _Below("reports/metrics.json")  # headline figures of the whole pipeline
    headline = _Below("reports/headline.json")  # the few of them by which runs are compared
    report = _Below("reports/index.html")  # the HTML report
    study_tables_dir = _Below("studies/tables")  # result tables of the studies (CSV)
    study_data_dir = _Below("studies/data")  # every single plan, error and prediction of the studies (Parquet)

    desk_dir = _Below(".desk")  # stores, logs and process files of the servers; nothing in it is a result
    scratch_dir = _Below(".desk/scratch")  # finished parts of stages that were killed

    @property
    def mlflow_store(self) -> Path:
        """Database of MLflow, absolute: it means the same from every folder."""
        return (self.desk_dir / "mlflow.db").resolve()

    @property
    def mlflow_artifacts(self) -> Path:
        """Folder of MLflow's artifacts, absolute."""
        return self.mlflow_store.with_name("mlartifacts")
