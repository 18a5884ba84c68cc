"""Where the files of the pipeline and of the studies are below the root folder: all file names in one place."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Layout:
    """Paths of every file that a stage reads or writes, below `root`."""

    root: Path = Path()

    @property
    def data_dir(self) -> Path:
        """Folder of the Parquet files."""
        return self.root / "data"

    @property
    def trees(self) -> Path:
        """Operation trees, one row per point."""
        return self.data_dir / "trees.parquet"

    @property
    def trees_dir(self) -> Path:
        """The experiment trees as operation-tree files."""
        return self.data_dir / "trees"

    @property
    def motions(self) -> Path:
        """Point-to-point motions, one row per motion."""
        return self.data_dir / "motions.parquet"

    @property
    def runs(self) -> Path:
        """Simulated runs, one row per motion and speed limit."""
        return self.data_dir / "runs.parquet"

    @property
    def samples_dir(self) -> Path:
        """Time series of every run, in shards."""
        return self.data_dir / "samples"

    @property
    def paths(self) -> Path:
        """Chebyshev coefficients of the path torques, one row per motion."""
        return self.data_dir / "paths.parquet"

    @property
    def features(self) -> Path:
        """Features and targets, one row per motion."""
        return self.data_dir / "features.parquet"

    @property
    def predictions(self) -> Path:
        """Predicted profile parameters of held-out motions."""
        return self.data_dir / "predictions.parquet"

    @property
    def profile_predictions(self) -> Path:
        """What the profile predictor says of held-out motions, before it joins `predictions`."""
        return self.data_dir / "profile_predictions.parquet"

    @property
    def plans(self) -> Path:
        """Every plan, one row per vertex."""
        return self.data_dir / "plans.parquet"

    @property
    def models_dir(self) -> Path:
        """Fitted predictors, a folder each."""
        return self.root / "models"

    @property
    def profile_predictor(self) -> Path:
        """Folder of the predictor of whole profiles."""
        return self.models_dir / "profile_predictor"

    @property
    def reports_dir(self) -> Path:
        """Folder of tables, metrics, figures and the report."""
        return self.root / "reports"

    @property
    def tables_dir(self) -> Path:
        """Result tables (CSV)."""
        return self.reports_dir / "tables"

    @property
    def figures_dir(self) -> Path:
        """Figures."""
        return self.reports_dir / "figures"

    @property
    def claims_dir(self) -> Path:
        """Claims of single chapters (CSV), joined in `tables_dir`."""
        return self.reports_dir / "claims"

    @property
    def feature_claims(self) -> Path:
        """Claims about features (thesis chapter 4)."""
        return self.claims_dir / "features.csv"

    @property
    def predictor_claims(self) -> Path:
        """Claims about predictors (thesis chapter 5)."""
        return self.claims_dir / "predictors.csv"

    @property
    def metrics_dir(self) -> Path:
        """Metrics of single stages (JSON), merged into `metrics`."""
        return self.reports_dir / "metrics"

    @property
    def metrics(self) -> Path:
        """Headline figures of the whole pipeline."""
        return self.reports_dir / "metrics.json"

    @property
    def report(self) -> Path:
        """The HTML report."""
        return self.reports_dir / "index.html"

    @property
    def study_tables_dir(self) -> Path:
        """Result tables of the studies (CSV)."""
        return self.root / "studies" / "tables"

    @property
    def study_data_dir(self) -> Path:
        """Every single plan, error and prediction of the studies (Parquet)."""
        return self.root / "studies" / "data"

    @property
    def mlflow_store(self) -> Path:
        """Database of MLflow, absolute: it means the same from every folder."""
        return (self.root / "mlflow.db").resolve()

    @property
    def mlflow_artifacts(self) -> Path:
        """Folder of MLflow's artifacts, absolute."""
        return self.mlflow_store.with_name("mlartifacts")
