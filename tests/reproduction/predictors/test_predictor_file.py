"""Predictors as plain arrays against scikit-learn, their files, and what is refused."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from reproduction.config import ForestParams, NeuralNetworkParams, TrainPredictorsParams
from reproduction.predictors.conversion import to_arrays
from reproduction.predictors.estimators import MODELS, fit, make_estimator
from reproduction.predictors.predictor_file import load_predictor, save_predictor
from reproduction.predictors.profile_parameters import input_names
from robojoule.errors import InputError
from robojoule.profile.parameters import TARGETS

NAMES = input_names()
FILES = ("predictor.json", "predictor.npz")
PARAMS = TrainPredictorsParams(
    seed=3,
    random_forest=ForestParams(n_estimators=7, min_samples_leaf=2, max_features=0.5),
    neural_network=NeuralNetworkParams(networks=3, hidden_layers=[9, 5], alpha=0.1, learning_rate=0.01, max_epochs=30),
)


def data(rows: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    inputs = random.gamma(2.0, 1.0, (rows, len(NAMES))) * np.linspace(0.01, 100, len(NAMES))
    inputs[:, 5] = 2.0  # an input that never varies
    targets = np.column_stack([inputs[:, 0] * inputs[:, 1], 0.1 + inputs[:, 2], inputs[:, -1] ** 2])
    return inputs, targets + random.normal(size=(rows, 3))


@pytest.fixture(scope="module", params=MODELS)
def fitted(request: pytest.FixtureRequest):
    inputs, targets = data(300, 1)
    estimator = fit(make_estimator(request.param, PARAMS), inputs, targets)
    return request.param, estimator


def test_predictions_equal_scikit_learn(fitted, tmp_path: Path) -> None:
    name, estimator = fitted
    save_predictor(to_arrays(estimator, name, NAMES, TARGETS), tmp_path / name)
    loaded = load_predictor(tmp_path / name)
    assert (loaded.model, loaded.inputs, loaded.targets) == (name, NAMES, TARGETS)
    for rows, seed in ((1, 5), (700, 6)):
        inputs, _ = data(rows, seed)
        np.testing.assert_allclose(loaded.predict(inputs), estimator.predict(inputs), rtol=1e-11, atol=1e-9)


def test_inputs_on_a_threshold_go_the_same_way(fitted) -> None:
    name, estimator = fitted
    inputs, _ = data(300, 1)  # the training rows: thresholds lie halfway between them
    inputs = np.repeat(inputs[:1], 400, axis=0)
    inputs[:, 3] = np.linspace(inputs[:, 3].min() - 1, inputs[:, 3].max() + 1, 400)
    arrays = to_arrays(estimator, name, NAMES, TARGETS)
    np.testing.assert_allclose(arrays.predict(inputs), estimator.predict(inputs), rtol=1e-11, atol=1e-9)


def test_same_predictor_same_bytes(fitted, tmp_path: Path) -> None:
    name, _ = fitted
    written = []
    for folder in ("a", "b"):
        estimator = fit(make_estimator(name, PARAMS), *data(300, 1))
        save_predictor(to_arrays(estimator, name, NAMES, TARGETS), tmp_path / folder / name)
        written.append([(tmp_path / folder / name / file).read_bytes() for file in FILES])
    assert written[0] == written[1]


def test_loading_and_predicting_need_no_scikit_learn(fitted, tmp_path: Path) -> None:
    name, estimator = fitted
    save_predictor(to_arrays(estimator, name, NAMES, TARGETS), tmp_path / name)
    code = (
        "import sys, numpy as np; from reproduction.predictors.predictor_file import load_predictor;"
        f"p = load_predictor({str(tmp_path / name)!r}); p.predict(np.ones((2, 39)));"
        "print(sorted({m.split('.')[0] for m in sys.modules} & {'sklearn', 'scipy', 'mlflow', 'pandas', 'joblib'}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("file", FILES)
@pytest.mark.parametrize("damage", ["missing", "truncated", "empty"])
def test_damaged_files_are_refused(fitted, tmp_path: Path, file: str, damage: str) -> None:
    name, estimator = fitted
    save_predictor(to_arrays(estimator, name, NAMES, TARGETS), tmp_path / name)
    path = tmp_path / name / file
    content = path.read_bytes()
    path.unlink()
    if damage != "missing":
        path.write_bytes(content[: len(content) // 2] if damage == "truncated" else b"")
    with pytest.raises(InputError, match=f"{name}/{file}"):
        load_predictor(tmp_path / name)


@pytest.mark.parametrize(
    ("key", "value"),
    [("members", 4), ("member", "tree"), ("format_version", 2), ("layers", 4), ("inputs", ["a"]), ("surprise", 1)],
)
def test_descriptions_that_do_not_fit_are_refused(fitted, tmp_path: Path, key: str, value: object) -> None:
    name, estimator = fitted
    if key == "layers" and name == "random_forest":
        key, value = "member", "network"
    save_predictor(to_arrays(estimator, name, NAMES, TARGETS), tmp_path / name)
    path = tmp_path / name / "predictor.json"
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | {key: value}), encoding="utf-8")
    with pytest.raises(InputError):
        load_predictor(tmp_path / name)


def test_objects_in_the_archive_are_refused(fitted, tmp_path: Path) -> None:
    name, estimator = fitted
    save_predictor(to_arrays(estimator, name, NAMES, TARGETS), tmp_path / name)
    path = tmp_path / name / "predictor.npz"
    with np.load(path) as stored:
        arrays = {key: stored[key] for key in stored.files}
    arrays["input_mean"] = np.array([{"code": 1}] * len(NAMES), dtype=object)
    np.savez(path, **arrays)
    with pytest.raises(InputError, match="does not hold a predictor"):
        load_predictor(tmp_path / name)


def test_tree_that_leads_nowhere_is_refused(tmp_path: Path) -> None:
    estimator = fit(make_estimator("random_forest", PARAMS), *data(50, 1))
    arrays = to_arrays(estimator, "random_forest", NAMES, TARGETS)
    arrays.members[1].right[arrays.members[1].feature >= 0] = 0
    save_predictor(arrays, tmp_path / "forest")
    with pytest.raises(InputError, match="child that does not exist"):
        load_predictor(tmp_path / "forest")


def test_wrong_inputs_are_refused(fitted) -> None:
    name, estimator = fitted
    arrays = to_arrays(estimator, name, NAMES, TARGETS)
    with pytest.raises(InputError, match=r"shape \(2, 38\); allowed: \(rows, 39\)"):
        arrays.predict(np.ones((2, 38)))
    values = np.ones((2, 39))
    values[1, 4] = np.nan
    with pytest.raises(InputError, match=NAMES[4]):
        arrays.predict(values)
