"""The stage that trains the profile predictor: fitted, read back, tried on held-out motions."""

import json
import re
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from reproduction.config import Params, load_params
from reproduction.layout import Layout
from reproduction.motions.tables import motions_of_trees, motions_table, runs_table
from reproduction.profile_predictor.simulated_runs import read_simulated_motions
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.parameters import TARGETS
from stages.generate_trees import generate_trees
from stages.train_profile_predictor import train_profile_predictor

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
    motions = motions_of_trees(pq.read_table(layout.trees))
    paths = MotionPaths(PARAMS.robot.robot(), motions.start_rad, motions.end_rad)
    pq.write_table(motions_table(motions, paths), layout.motions)
    pq.write_table(runs_table(motions.motion_id, paths.simulate(LIMITS)), layout.runs)
    train_profile_predictor(SMALL, layout)
    return layout


def outputs(layout: Layout) -> dict[str, bytes]:
    files = [*layout.profile_predictor.iterdir(), layout.profile_predictions, *layout.metrics_dir.iterdir()]
    return {path.relative_to(layout.root).as_posix(): path.read_bytes() for path in files}


def test_predicts_held_out_motions(layout: Layout):
    rows = pq.read_table(layout.profile_predictions)
    names = ["motion_id", "tree_id", "split", "model", *TARGETS, *(f"{target}_simulated" for target in TARGETS)]
    assert rows.column_names == names
    motions = pq.read_table(layout.motions, filters=[("split", "!=", "train")])
    assert rows["motion_id"].to_pylist() == motions["motion_id"].to_pylist()
    assert set(rows["split"].to_pylist()) == {"test", "experiment"}
    simulated = rows["energy_penalty_j_simulated"].to_numpy()
    # The plant of the pipeline is the entry itself, simulated without noise.
    assert np.median(np.abs(rows["energy_penalty_j"].to_numpy() - simulated) / simulated) < 0.01


def test_says_how_good_its_interval_is(layout: Layout):
    metrics = json.loads((layout.metrics_dir / "profile_predictor.json").read_text(encoding="utf-8"))
    (interval,) = metrics["interval"].values()
    assert 0 < interval["coverage_percent"] <= 100 and interval["half_width_percent"] > 0


def test_same_data_same_bytes(layout: Layout):
    before = outputs(layout)
    assert {name.rpartition("/")[2] for name in before} >= {"predictor.npz", "predictor.json"}
    train_profile_predictor(SMALL, layout)
    assert outputs(layout) == before


def fewer(params: Params, **changes: int) -> Params:
    settings = params.train_profile_predictor.model_copy(update=changes)
    return params.model_copy(update={"train_profile_predictor": settings})


def test_trains_on_as_many_trees_and_runs_as_the_parameters_say(layout: Layout, tmp_path: Path):
    """Speed limits that give the same run count once, so that there may be fewer."""
    counts = {}
    for runs in (2, 3):
        here = Layout(tmp_path / str(runs))
        here.data_dir.mkdir(parents=True)
        for path in (layout.motions, layout.runs):
            (here.data_dir / path.name).symlink_to(path)
        train_profile_predictor(fewer(SMALL, training_trees=2, runs_per_motion=runs), here)
        note = json.loads((here.profile_predictor / "predictor.json").read_text(encoding="utf-8"))["note"]
        counts[runs] = int(re.fullmatch(r"trained on (\d+) simulated runs of 2 operation trees .*", note)[1])
    motions = len(pq.read_table(layout.motions, filters=[("tree_id", "==", "train-001")]))
    assert counts[2] < counts[3] <= 3 * 2 * motions and counts[2] <= 2 * 2 * motions


def test_missing_runs_and_unknown_splits_are_refused(layout: Layout, tmp_path: Path):
    robot = PARAMS.robot.robot()
    with pytest.raises(InputError, match="no motion of the split"):
        read_simulated_motions(robot, layout.motions, layout.runs, "validation")
    with pytest.raises(InputError, match="file is missing"):
        read_simulated_motions(robot, layout.motions, tmp_path / "runs.parquet", "train")
    runs = pq.read_table(layout.runs)
    pq.write_table(runs.take(np.arange(0, len(runs), 3)), tmp_path / "runs.parquet")
    with pytest.raises(InputError, match="not one run"):
        read_simulated_motions(robot, layout.motions, tmp_path / "runs.parquet", "train")
