"""The profile predictor of the pipeline: fitted, read back, judged, registered only if it passes."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from reproduction.config import load_params
from reproduction.motions.tables import motions_of_trees, motions_table, runs_table
from reproduction.predictors.simulated_runs import read_simulated_motions
from reproduction.tracking.store import Recorder, store_uri
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload
from stages._profile_predictor import REGISTERED, read_simulated, record_profile_predictor, train_profile_predictor
from stages.generate_trees import generate_trees
from stages.layout import Layout

PARAMS = load_params(Path(__file__).parents[2] / "params.yaml")
SMALL = PARAMS.model_copy(
    update={
        "generate_trees": PARAMS.generate_trees.model_copy(update={"trees": 10, "experiment_trees": 3, "points": 2})
    }
)
LIMITS = np.array([0.1, 0.3, 0.5, 0.7, 1.0])


@pytest.fixture(scope="module")
def layout(tmp_path_factory: pytest.TempPathFactory) -> Layout:
    layout = Layout(tmp_path_factory.mktemp("project"))
    generate_trees(SMALL, layout)
    robot = load_robot(PARAMS.robot.name, Payload(PARAMS.robot.payload_kg, PARAMS.robot.payload_com_m))
    motions = motions_of_trees(pq.read_table(layout.trees))
    paths = MotionPaths(robot, motions.start_rad, motions.end_rad)
    pq.write_table(motions_table(motions, paths), layout.motions)
    pq.write_table(runs_table(motions.motion_id, paths.simulate(LIMITS)), layout.runs)
    layout.features.write_bytes(b"what the record hashes")
    return layout


@pytest.fixture(scope="module")
def training(layout: Layout):
    return train_profile_predictor(layout, read_simulated(SMALL, layout))


def test_predicts_held_out_motions_from_the_files_it_wrote(layout, training):
    assert (layout.models_dir / "profile_predictor" / "predictor.npz").exists()
    splits = np.array(training.predictions["split"].to_pylist())
    assert set(splits) == {"test", "experiment"}
    error = np.abs(
        training.predictions["energy_penalty_j"].to_numpy()
        - training.predictions["energy_penalty_j_measured"].to_numpy()
    )
    # The plant of the pipeline is the entry itself, measured without noise.
    assert np.median(error / training.predictions["energy_penalty_j_measured"].to_numpy()) < 0.01


def test_the_bytes_of_the_model_are_stable(layout, training):
    before = {path.name: path.read_bytes() for path in (layout.models_dir / "profile_predictor").iterdir()}
    train_profile_predictor(layout, read_simulated(SMALL, layout))
    assert before == {path.name: path.read_bytes() for path in (layout.models_dir / "profile_predictor").iterdir()}


def test_only_a_model_that_passes_the_gate_is_registered(layout, training):
    import mlflow

    test = training.predictions.filter(pa.compute.equal(training.predictions["split"], "test"))
    perfect = np.column_stack(
        [test[f"{name}_measured"].to_numpy() for name in ("energy_saving_j", "optimal_duration_s", "energy_penalty_j")]
    )
    assert training.passes()
    assert not training.passes([perfect])
    recorder = Recorder(layout, SMALL)
    assert not record_profile_predictor(recorder, training, {}, [perfect])
    client = mlflow.MlflowClient(store_uri(layout))
    assert client.search_registered_models() == []
    assert record_profile_predictor(recorder, training, {})
    version = client.get_model_version_by_alias(REGISTERED, "champion")
    model = mlflow.pyfunc.load_model(f"models:/{REGISTERED}/{version.version}")
    table = pq.read_table(layout.motions).slice(0, 3).to_pandas().assign(speed_limit_percent=50.0)
    measured = pq.read_table(layout.runs, filters=[("motion_id", "<", 3), ("speed_limit_percent", "==", 50.0)])
    found = model.predict(table)
    np.testing.assert_allclose(found["energy_j"], measured["energy_j"].to_numpy(), rtol=0.01)
    np.testing.assert_allclose(found["duration_s"], measured["duration_s"].to_numpy(), rtol=1e-9)


def test_missing_runs_and_unknown_splits_are_refused(layout, tmp_path):
    robot = load_robot(PARAMS.robot.name, Payload(PARAMS.robot.payload_kg))
    with pytest.raises(InputError, match="no motion of the split"):
        read_simulated_motions(robot, layout.motions, layout.runs, "validation")
    with pytest.raises(InputError, match="file is missing"):
        read_simulated_motions(robot, layout.motions, tmp_path / "runs.parquet", "train")
    runs = pq.read_table(layout.runs)
    pq.write_table(runs.take(np.arange(0, len(runs), 3)), tmp_path / "runs.parquet")
    with pytest.raises(InputError, match="not one run"):
        read_simulated_motions(robot, layout.motions, tmp_path / "runs.parquet", "train")
