"""The regimes end to end, small; nested cross-validation; the committed parameters."""

from pathlib import Path

import numpy as np
import pytest

from reproduction.study import comparison, regimes, three_numbers
from reproduction.study.ablations import ABLATIONS, METHODS
from reproduction.study.config import StudyParams, load_study_params
from tests.reproduction.study import cases

ROOT = Path(__file__).parents[3]
PREDICTED = "robojoule_predicted"


@pytest.fixture(scope="module")
def params() -> StudyParams:
    return cases.small_study()


def gap(tables, method, **key):
    rows = [r for r in tables.gaps if r["method"] == method and key.items() <= r.items()]
    return float(np.mean([row["gap_mean_percent"] for row in rows]))


def test_new_motions_are_planned_near_the_optimum(params):
    tables = regimes.same_robot(params, lambda _: None)
    own = gap(tables, "robojoule_predicted", payload_kg="all")
    assert own < 0.5
    assert own < min(gap(tables, name, payload_kg="all") for name in ("krc_polynomial_6", "predicted_three_segment"))
    assert {row["payload_kg"] for row in tables.errors} == {0.0, 10.0}
    means = {
        (part, case): np.mean(
            [row["gap_mean_percent"] for row in tables.ablations if (row["part"], row["case"]) == (part, case)]
        )
        for part, cases in ABLATIONS.items()
        for case in cases
    }
    for part, best in (("representation", "dense"), ("idle_power", "configuration"), ("predictor", PREDICTED)):
        assert means[part, best] == min(means[part, case] for case in ABLATIONS[part])
    # What only ablations need stays out of the other tables; what both show is the same.
    assert not {row["method"] for row in tables.gaps + tables.wins} & set(METHODS)
    assert means["predictor", PREDICTED] == pytest.approx(own)


def test_an_unseen_payload_is_planned_near_the_optimum(params):
    assert gap(regimes.unseen_payload(params, lambda _: None), "robojoule_predicted", payload_kg="all") < 1.0


def test_an_unseen_robot_gains_by_measured_motions(params):
    tables = regimes.unseen_robot(params, lambda _: None)
    assert gap(tables, "robojoule_predicted_6", robot="all") < gap(tables, "nominal_physics", robot="all")
    assert {row["robot"] for row in tables.coverage} == set(params.evaluate_robots.robots)


def test_cross_validation_holds_every_motion_out_once(params):
    found = comparison.compare_models(params, lambda _: None)
    models = (*three_numbers.MODELS, *comparison.PHYSICS)
    motions = 10 * 2 * params.motions.points
    for model in models:
        rows = [row for row in found.predictions if row["model"] == model]
        assert len(rows) == motions
        assert np.isfinite([row["energy_saving_j"] for row in rows]).all()

    def penalty(model):
        return next(
            row["rel_p50_percent"] for row in found.rows if row["model"] == model and "penalty" in str(row["target"])
        )

    folds = params.compare_predictors.outer_folds
    assert len(found.fold_rows) == folds * len(found.rows)
    for row in found.rows:
        own = [one for one in found.fold_rows if (one["model"], one["target"]) == (row["model"], row["target"])]
        assert sum(int(one["motions"]) for one in own) == row["motions"]
        assert max(one["rel_max_percent"] for one in own) == row["rel_max_percent"]
    assert penalty("robojoule_predicted") < min(penalty(model) for model in three_numbers.MODELS)


def test_streams_of_one_seed_differ_by_purpose_and_key():
    first, second = regimes.streams(1, 2), regimes.streams(1, 3)
    states = {tuple(s.generate_state(2).tolist()) for of in (first, second) for s in of.values()}
    assert len(states) == 2 * len(regimes.STREAMS)


def test_features_are_zero_for_no_motion():
    paths = cases.batch(cases.plant(), 1, 2).nominal_paths
    features = three_numbers.motion_features(paths, 0.1)
    assert features.shape == (paths.motions, 39)
    assert (features >= 0.0).all()


def test_the_committed_parameters_are_valid():
    assert load_study_params(ROOT / "studies" / "params.yaml").evaluate_robots.measured_motions == [0, 10, 50]
