"""The record of the profile predictor: registered only if it passes its gate, and served as it was judged."""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from reproduction.config import load_params
from reproduction.layout import Layout
from reproduction.profile_predictor.training import MODEL
from reproduction.tracking.profile_predictor import REGISTERED, record_profile_predictor
from reproduction.tracking.store import connect, store_uri
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.parameters import TARGETS
from robojoule.profile.predicted import calibrated_predictor
from robojoule.profile.predictor_file import load_profile_predictor, save_profile_predictor
from robojoule.robots import load_robot

PARAMS = load_params(Path(__file__).parents[3] / "params.yaml")
SIMULATED = np.array([[100.0, 1.0, 700.0], [50.0, 0.8, 500.0], [20.0, 0.5, 300.0]])
TRAINING = np.array([[300.0, 2.0, 2000.0], [200.0, 1.5, 1000.0]])


@pytest.fixture
def layout(tmp_path: Path) -> Layout:
    layout = Layout(tmp_path)
    save_profile_predictor(calibrated_predictor(PARAMS.robot.robot()), layout.profile_predictor)
    layout.data_dir.mkdir()
    layout.features.write_bytes(b"what the record hashes")
    return layout


def predictions(**factors: float) -> pa.Table:
    """Predictions of three test motions by some models, off by a factor."""
    columns: dict[str, list] = {"model": [name for name in factors for _ in SIMULATED]}
    for place, target in enumerate(TARGETS):
        columns[target] = [value for factor in factors.values() for value in factor * SIMULATED[:, place]]
        columns[f"{target}_simulated"] = [value for _ in factors for value in SIMULATED[:, place]]
    return pa.table(columns)


@pytest.mark.parametrize("rival", [1.0, 1.005, 0.999])
def test_a_predictor_that_a_rival_beats_is_recorded_but_not_registered(layout: Layout, rival: float):
    mlflow = connect(layout)
    test = predictions(**{MODEL: 1.01, "random_forest": rival})
    line = record_profile_predictor(mlflow, PARAMS, layout, test, TRAINING, {}, ["random_forest"])
    assert line == f"{MODEL}, recorded in MLflow, refused by its gate"
    client = mlflow.MlflowClient(store_uri(layout))
    assert client.search_registered_models() == []
    (run,) = client.search_runs([mlflow.get_experiment_by_name("pipeline").experiment_id])
    assert run.data.tags["passes_gate"] == "false"
    assert {Path(item.path).name for item in client.list_artifacts(run.info.run_id, "rejected")} == {
        path.name for path in layout.profile_predictor.iterdir()
    }


def test_one_that_passes_is_registered_and_served(layout: Layout):
    mlflow = connect(layout)
    test = predictions(**{MODEL: 1.01, "random_forest": 1.1})
    figures = {"interval": {MODEL: {"coverage_percent": 91.0}}}
    line = record_profile_predictor(mlflow, PARAMS, layout, test, TRAINING, figures, ["random_forest"])
    assert line == f"{MODEL}, recorded in MLflow and registered"
    client = mlflow.MlflowClient(store_uri(layout))
    version = client.get_model_version_by_alias(REGISTERED, "champion")
    run = client.get_run(version.run_id)
    assert run.data.metrics[f"predictors.interval.{MODEL}.coverage_percent"] == 91.0
    assert run.data.params["training_trees"] == str(PARAMS.train_profile_predictor.training_trees)
    model = mlflow.pyfunc.load_model(f"models:/{REGISTERED}/{version.version}")

    robot = load_robot(PARAMS.robot.name, payload_kg=10.0)
    end = robot.home_rad + 0.3
    paths = MotionPaths(robot, robot.home_rad, end)
    expected = load_profile_predictor(layout.profile_predictor).predict(paths, np.array([[0.5]]))
    ends = {"start": robot.home_rad, "end": end}
    asked = {f"{side}_q{joint + 1}_rad": [q] for side, qs in ends.items() for joint, q in enumerate(qs)}
    given = pa.table({"payload_kg": [10.0], "speed_limit_percent": [50.0], **asked}).to_pandas()
    # Rows of two payloads that bear the same index, as of two tables put together: each has its own energy.
    both = pd.concat([given, given.assign(payload_kg=5.0), given])
    energies = model.predict(both)["energy_j"]
    assert energies.index.to_list() == [0, 0, 0]
    assert energies.to_list() == [model.predict(one)["energy_j"].item() for one in (given, both.iloc[[1]], given)]
    assert energies.iloc[0] > energies.iloc[1]
    unwrapped = model.unwrap_python_model()
    with pytest.raises(InputError, match="payload_kg: row 2 holds nan; allowed: finite numbers"):
        unwrapped.predict(None, both.assign(payload_kg=[10.0, np.nan, 10.0]))
    found = model.predict(given)
    for name in ("duration_s", "energy_j", "lower_j", "upper_j"):
        assert found[name].to_list() == pytest.approx(getattr(expected, name)[0].tolist())
    assert found["duration_s"].to_list() == pytest.approx(paths.simulate([0.5]).duration_s[0].tolist())
