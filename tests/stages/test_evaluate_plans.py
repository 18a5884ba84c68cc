"""The stage that compares methods: on a few trees with all methods, same bytes each time, clear errors."""

import csv
import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from reproduction.claims import Claim, write_claims
from reproduction.config import Params
from reproduction.experiment.data import FINAL_POWER_WINDOW_S, read_experiment
from reproduction.layout import Layout
from reproduction.profile_predictor.fit import fit_profile_predictor
from reproduction.profile_predictor.simulated_runs import read_simulated_motions
from robojoule.errors import InputError
from robojoule.profile.predictor_file import save_profile_predictor
from robojoule.profile.sampled import sampled_profile
from robojoule.robots import load_robot
from stages.evaluate_plans import evaluate_plans
from stages.generate_trees import generate_trees
from stages.simulate_motions import simulate_motions

PARAMS = yaml.safe_load((Path(__file__).parents[2] / "params.yaml").read_text())
PARAMS["generate_trees"] |= {"trees": 2, "experiment_trees": 3, "points": 2}
PARAMS["evaluate_plans"] |= {
    "relaxations_percent": [110, 200],
    "dense_speed_limits": 90,
    "payload_sensitivity_kg": [0, 10],
}


def perfect_predictions(layout):
    """Predictions of a predictor that knows the measured runs."""
    motions = pq.read_table(layout.motions)
    runs = pq.read_table(layout.runs)
    rows = []
    for motion, tree, split in zip(*(motions[n].to_pylist() for n in ("motion_id", "tree_id", "split")), strict=True):
        if split != "experiment":
            continue
        mine = runs.filter(pa.compute.equal(runs["motion_id"], motion))
        d, e, p = (mine[name].to_numpy() for name in ("duration_s", "energy_j", "speed_limit_percent"))
        profile = sampled_profile(d, e, p / 100.0)
        values = profile.saving_j, float(profile.durations_s[profile.optimum]), profile.penalty_j
        for model, factor in (("neural_network", 2.0), ("random_forest", 1.0)):
            names = ("energy_saving_j", "optimal_duration_s", "energy_penalty_j")
            row = {"motion_id": motion, "tree_id": tree, "split": split, "model": model}
            rows.append(row | {name: factor * value for name, value in zip(names, values, strict=True)})
    return pa.Table.from_pylist(rows[::-1])  # the order of the file must not matter


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    layout = Layout(tmp_path_factory.mktemp("run"))
    params = Params.model_validate(PARAMS)
    generate_trees(params, layout)
    simulate_motions(params, layout)
    pq.write_table(perfect_predictions(layout), layout.predictions)
    robot = params.robot.robot()
    simulated = read_simulated_motions(robot, layout.motions, layout.runs, "train").runs
    save_profile_predictor(fit_profile_predictor(robot, [simulated]), layout.profile_predictor)
    write_claims(layout.feature_claims, [Claim("distances matter", "yes", "0.7", True)])
    write_claims(layout.predictor_claims, [Claim("forests are exact", "yes", "12 %", None)])
    evaluate_plans(params, layout)
    return params, layout


def linked(layout, root):
    """What the stage reads, linked into another folder."""
    here = Layout(root)
    here.data_dir.mkdir()
    for path in set(layout.data_dir.iterdir()) - {layout.plans}:
        (here.data_dir / path.name).symlink_to(path)
    here.models_dir.symlink_to(layout.models_dir)
    here.reports_dir.mkdir()
    here.claims_dir.symlink_to(layout.claims_dir)
    return here


def results_in(layout):
    """Names of what the stage wrote."""
    return [path.name for path in (layout.plans, layout.tables_dir, layout.metrics_dir) if path.exists()]


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


OUTPUTS = (
    "table_6_1",
    "table_6_1_thesis",
    "table_6_2",
    "table_6_3",
    "payload_sensitivity",
    "claims",
    "gaps",
    "wins",
)


def test_every_plan_is_there_and_none_is_late(done):
    _, layout = done
    plans = pq.read_table(layout.plans)
    assert plans.num_rows == 3 * 2 * 11 * 4
    total = plans.group_by(
        [
            "tree_id",
            "relaxation_percent",
            "method",
            "krc_segments",
            "point_spacing",
            "cycle_time_s",
            "simulated_energy_j",
        ]
    ).aggregate([(name, "sum") for name in ("duration_s", "prior_wait_s", "post_wait_s", "vertex_energy_j")])
    times = sum(total[f"{name}_sum"].to_numpy() for name in ("duration_s", "prior_wait_s", "post_wait_s"))
    assert np.abs(times - total["cycle_time_s"].to_numpy()).max() < 1e-6
    assert total["vertex_energy_j_sum"].to_numpy() == pytest.approx(total["simulated_energy_j"].to_numpy())
    assert plans["speed_limit_percent"].to_numpy().max() <= 100.0


def test_the_optimum_is_proven_and_nothing_is_better(done):
    _, layout = done
    plans = pq.read_table(layout.plans).to_pylist()
    best = {(p["tree_id"], p["relaxation_percent"]): p for p in plans if p["method"] == "optimum"}
    for plan in plans:
        optimum = best[plan["tree_id"], plan["relaxation_percent"]]
        assert plan["simulated_energy_j"] >= optimum["bound_j"] - 1e-6
        assert plan["simulated_energy_j"] >= (1 - 1e-4) * optimum["simulated_energy_j"]
    for optimum in best.values():
        assert optimum["simulated_energy_j"] <= optimum["bound_j"] * (1 + 1e-4)


def test_tables_hold_every_method(done):
    _, layout = done
    rows = rows_of(layout.tables_dir / "table_6_1.csv")
    assert list(rows[0]) == [
        "relaxation_percent",
        "krc_segments",
        "method",
        "saving_percent",
        "saving_percent_published_convention",
        "gap_to_optimum_percent",
        "trees",
    ]
    assert [(row["method"], row["krc_segments"]) for row in rows[:9]] == [
        ("unoptimized", ""),
        ("uniform", ""),
        ("greedy", ""),
        ("krc_polynomial", "4"),
        ("krc_polynomial", "6"),
        ("predicted_three_segment", ""),
        ("robojoule_predicted", ""),
        ("robojoule_simulated", ""),
        ("optimum", ""),
    ]
    assert {row["trees"] for row in rows} == {"3"}
    for row in rows:
        assert float(row["gap_to_optimum_percent"]) >= -0.01
        assert (row["method"] == "unoptimized") == (float(row["saving_percent"]) == 0.0)
    assert len(rows_of(layout.tables_dir / "table_6_2.csv")) == len(rows_of(layout.tables_dir / "table_6_3.csv")) == 3
    assert {row["subset"] for row in rows_of(layout.tables_dir / "table_6_1_thesis.csv")} == {"1-10", "11-20", "21-30"}


def test_gaps_have_confidence_wins_and_the_runs_they_cost(done):
    _, layout = done
    gaps = rows_of(layout.tables_dir / "gaps.csv")
    means = {(row["relaxation_percent"], row["method"]): float(row["gap_mean_percent"]) for row in gaps}
    for row in rows_of(layout.tables_dir / "table_6_1.csv"):
        name = row["method"] + (f"_{row['krc_segments']}" if row["krc_segments"] else "")
        assert means[row["relaxation_percent"], name] == float(row["gap_to_optimum_percent"])
    for row in gaps:
        low, mean, high, worst = (float(row[f"gap_{name}_percent"]) for name in ("low", "mean", "high", "worst"))
        assert low <= mean <= high <= worst + 1e-4
        if row["method"].startswith(("robojoule", "optimum")):
            assert worst < 0.2
            assert float(row["above_unoptimized_percent"]) == 0.0
    runs = {row["method"]: float(row["runs_per_motion"]) for row in gaps}
    assert runs["unoptimized"] == runs["uniform"] == runs["robojoule_predicted"] == 0
    assert (runs["predicted_three_segment"], runs["krc_polynomial_6"], runs["greedy"]) == (2, 5, 10)
    assert 5 < runs["robojoule_simulated"] < runs["optimum"]
    metrics = json.loads((layout.metrics_dir / "plans.json").read_text())
    assert metrics["robojoule_predicted"]["runs_per_motion"] == 0
    duels = {(r["relaxation_percent"], r["method"], r["other"]): r for r in rows_of(layout.tables_dir / "wins.csv")}
    for (relaxation, method, other), row in duels.items():
        assert (row["wins"], row["losses"]) == (
            duels[relaxation, other, method]["losses"],
            duels[relaxation, other, method]["wins"],
        )
    assert duels["200", "robojoule_predicted", "predicted_three_segment"]["wins"] == "3"


def test_a_lighter_load_needs_less_power(done):
    _, layout = done
    rows = rows_of(layout.tables_dir / "payload_sensitivity.csv")
    power = {row["payload_kg"]: float(row["mean_power_full_speed_w"]) for row in rows}
    assert list(power) == ["0", "10"]
    assert power["0"] != power["10"]
    main = [r for r in rows_of(layout.tables_dir / "table_6_1.csv") if r["method"] == "optimum"]
    here = [r for r in rows if r["method"] == "optimum" and r["payload_kg"] == "10"]
    assert [r["saving_percent"] for r in here] == [r["saving_percent"] for r in main]


def test_metrics_are_those_of_the_table(done):
    _, layout = done
    metrics = json.loads((layout.metrics_dir / "plans.json").read_text())
    for row in rows_of(layout.tables_dir / "table_6_1.csv"):
        name = row["method"] + (f"_{row['krc_segments']}" if row["krc_segments"] else "")
        assert metrics[name][row["relaxation_percent"]]["saving_percent"] == float(row["saving_percent"])
    assert set(metrics["krc_polynomial"]) == {"110", "200", "runs_per_motion"}


def test_what_methods_know_comes_from_the_right_rows(done):
    params, layout = done
    data = read(params, layout)
    motions = pq.read_table(layout.motions, filters=[("split", "==", "experiment")])
    known = data.knowledge
    found = [(one.saving_j, one.durations_s[one.optimum], one.penalty_j) for one in known.simulated]
    assert known.predicted_parameters == pytest.approx(np.array(found))
    assert known.runs_per_motion == len(PARAMS["simulate_motions"]["speed_limits_percent"])
    samples = data.batch.paths.sample(5, 0.1, 250.0)
    final = samples.time_s >= samples.time_s[-1] - FINAL_POWER_WINDOW_S
    assert known.final_power_w[5] == pytest.approx(samples.power_w[final].mean(), rel=1e-3)
    assert data.batch.idle_post_w == pytest.approx(motions["idle_power_end_w"].to_numpy())
    assert data.batch.d_min_s == pytest.approx([one.durations_s[0] for one in known.simulated], rel=1e-9)


def read(params, layout):
    return read_experiment(params.robot.robot(), layout, params.evaluate_plans.predicted_speed_limits)


def test_the_same_input_gives_the_same_bytes(done):
    params, layout = done
    paths = [layout.plans, layout.metrics_dir / "plans.json", *(layout.tables_dir / f"{name}.csv" for name in OUTPUTS)]
    before = [path.read_bytes() for path in paths]
    evaluate_plans(params, layout)
    assert [path.read_bytes() for path in paths] == before


def test_claims_follow_the_chapters(done):
    _, layout = done
    rows = [(row["claim"], row["held"]) for row in rows_of(layout.tables_dir / "claims.csv")]
    assert rows[:2] == [("distances matter", "true"), ("forests are exact", "")]
    assert len(rows) > 2 and {held for _, held in rows[2:]} <= {"true", "false"}


@pytest.mark.parametrize(
    ("missing", "stage"),
    [
        ("predictions", "train_predictors"),
        ("runs", "simulate_motions"),
        ("trees", "generate_trees"),
        ("profile_predictor", "train_profile_predictor"),
    ],
)
def test_a_missing_result_names_the_stage_that_writes_it(done, tmp_path, missing, stage):
    params, layout = done
    here = linked(layout, tmp_path)
    if missing == "profile_predictor":
        here.models_dir.unlink()
    else:
        getattr(here, missing).unlink()
    with pytest.raises(InputError, match=rf"{missing}.*: the (file|folder) is missing; run the stage {stage} first"):
        evaluate_plans(params, here)
    assert results_in(here) == []


def test_missing_claims_are_named_before_anything_is_planned(done, tmp_path):
    params, layout = done
    here = linked(layout, tmp_path)
    here.claims_dir.unlink()
    with pytest.raises(InputError, match=r"claims/features\.csv: the table cannot be read"):
        evaluate_plans(params, here)
    assert results_in(here) == []


@pytest.mark.parametrize(
    ("name", "column", "value"),
    [
        ("trees", "q2_rad", "x"),
        ("runs", "energy_j", np.nan),
        ("predictions", "energy_saving_j", None),
        ("trees", "complexity", None),
    ],
)
def test_a_garbled_column_is_named_and_nothing_written(done, tmp_path, name, column, value):
    params, layout = done
    here = linked(layout, tmp_path)
    table = pq.read_table(getattr(layout, name))
    values = pa.array([value] * len(table))
    getattr(here, name).unlink()
    pq.write_table(table.set_column(table.column_names.index(column), column, values), getattr(here, name))
    with pytest.raises(InputError, match=rf"{name}\.parquet, {column}: "):
        evaluate_plans(params, here)
    assert results_in(here) == []


def test_a_foreign_predictor_is_refused(done, tmp_path):
    params, layout = done
    here = linked(layout, tmp_path)
    here.models_dir.unlink()
    robot = load_robot("kuka_kr10_r1100_2")
    save_profile_predictor(fit_profile_predictor(robot, []), here.profile_predictor)
    with pytest.raises(InputError, match="the predictor knows kuka_kr10_r1100_2, not kuka_kr16_r2010_2"):
        evaluate_plans(params, here)
    assert results_in(here) == []


def test_predictions_without_a_tree_are_refused(done, tmp_path):
    params, layout = done
    here = linked(layout, tmp_path)
    here.predictions.unlink()
    pq.write_table(pq.read_table(layout.predictions, filters=[("tree_id", "!=", "experiment-02")]), here.predictions)
    with pytest.raises(InputError, match=r"predictions\.parquet, tree_id: the motions are not those of the experiment"):
        read(params, here)


def test_runs_of_other_trees_are_refused(done, tmp_path):
    params, layout = done
    here, other = linked(layout, tmp_path), Layout(tmp_path / "other")
    generate_trees(Params.model_validate(PARAMS | {"generate_trees": PARAMS["generate_trees"] | {"seed": 1}}), other)
    here.trees.unlink()
    here.trees.symlink_to(other.trees)
    with pytest.raises(InputError, match=r"runs\.parquet, duration_s: the runs are not those of the experiment trees"):
        read(params, here)
