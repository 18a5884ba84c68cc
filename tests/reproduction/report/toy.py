"""A small set of results: simulated motions and their real features, simple predictions and plans, hand-made tables."""

import atexit
import csv
import json
import shutil
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from reproduction import features
from reproduction.experiment.results import PLANS_SCHEMA
from reproduction.layout import Layout
from reproduction.methods.three_segment_profile import ThreeSegmentShape
from reproduction.motions.tables import motions_of_trees, motions_table, runs_table, write_samples
from reproduction.report.gallery import Picture, draw_all
from reproduction.report.results import Results
from reproduction.trees.generate import retrace
from robojoule.formats.tree_files import save_tree
from robojoule.motion.simulation import MotionPaths
from robojoule.plots.style import Style
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.robots.robot import Robot
from tests.core_cases import kr16

SPLITS = ("train", "test", "test", "experiment", "experiment", "experiment")
SPEED_LIMITS = np.array([10, 25, 40, 55, 70, 85, 100]) / 100.0
TARGETS = ("energy_saving_j", "optimal_duration_s", "energy_penalty_j")
RELAXATIONS = (110.0, 200.0)
GAP = {"mean": 0.0, "low": -0.1, "high": 0.2, "worst": 0.5}
VARIANTS = (
    ("unoptimized", None, None),
    ("krc_polynomial", 4, "speed"),
    ("krc_polynomial", 4, "duration"),
    ("predicted_three_segment", None, None),
    ("optimum", None, None),
)


@cache
def shared_root() -> Path:
    """Toy results of the KR 16 that several test modules read and nobody changes; removed when the tests end."""
    folder = tempfile.mkdtemp(prefix="robojoule-toy-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    make(Path(folder) / "results", kr16())
    return Path(folder) / "results"


@cache
def shared_pictures() -> tuple[Picture, ...]:
    """All figures of the shared results: drawing them takes seconds."""
    return tuple(draw_all(results(shared_root(), kr16()), Style()))


def results(root: Path, robot: Robot) -> Results:
    return Results(Layout(root), robot, ThreeSegmentShape())


def make(root: Path, robot: Robot, points: int = 2) -> None:
    """Write everything that draw_figures reads, for six trees of `points` random points each."""
    data, tables = root / "data", root / "reports/tables"
    (data / "samples").mkdir(parents=True)
    tables.mkdir(parents=True)
    _simulate(data, robot, points)
    connection = features.connect(data / "motions.parquet", data / "samples/*.parquet", data / "runs.parquet")
    features.build(connection, (*features.FEATURE_TABLES, *features.FINDING_TABLES))
    pq.write_table(features.fetch(connection, "features"), data / "features.parquet")
    for name in features.FINDING_TABLES:
        connection.table(name).write_csv(str(tables / f"{name}.csv"))
    _predict(data)
    _plan(data)
    _write_tables(tables)
    (root / "reports/metrics").mkdir()
    for name, content in {"energy_model": {"idle_power_home_w": 430.5}, "predictors": {}, "plans": {}}.items():
        (root / f"reports/metrics/{name}.json").write_text(json.dumps(content), encoding="utf-8")


def _simulate(data: Path, robot: Robot, points: int) -> None:
    rng = np.random.default_rng(4)
    rows = []
    for number, split in enumerate(SPLITS, start=1):
        targets = robot.home_rad + np.cumsum(rng.normal(0.0, 0.3, (points, robot.joint_count)), axis=0)
        path = retrace(robot.home_rad, np.clip(targets, robot.lower_rad, robot.upper_rad))
        name = f"{split}-{number:02d}"
        rows += [
            {"tree_id": name, "split": split, "point": point} | {f"q{j + 1}_rad": float(v) for j, v in enumerate(q)}
            for point, q in enumerate(path)
        ]
        if split == "experiment":
            save_tree(tree_from_configurations(name, path, robot.name), data / f"trees/{name}.yaml")
    trees = pa.Table.from_pylist(rows)
    pq.write_table(trees, data / "trees.parquet")
    motions = motions_of_trees(trees)
    paths = MotionPaths(robot, motions.start_rad, motions.end_rad)
    pq.write_table(motions_table(motions, paths), data / "motions.parquet")
    pq.write_table(runs_table(motions.motion_id, paths.simulate(SPEED_LIMITS)), data / "runs.parquet")
    write_samples(data / "samples/part-0000.parquet", motions.motion_id, paths, SPEED_LIMITS, 250.0)


def _predict(data: Path) -> None:
    """Predictions that are the truth times factors near one."""
    truth = pq.read_table(data / "features.parquet").to_pylist()
    rng = np.random.default_rng(5)
    rows = []
    for model in ("random_forest", "neural_network"):
        for row in truth:
            if row["split"] == "train":
                continue
            new = {name: row[name] for name in ("motion_id", "tree_id", "split")} | {"model": model}
            for target in TARGETS:
                new |= {target: row[target] * rng.uniform(0.8, 1.2), f"{target}_simulated": row[target]}
            rows.append(new)
    pq.write_table(pa.Table.from_pylist(rows), data / "predictions.parquet")


def _plan(data: Path) -> None:
    """Plans that stretch every motion alike; of the two KRC variants the one equidistant in duration is the better."""
    truth = [row for row in pq.read_table(data / "features.parquet").to_pylist() if row["split"] == "experiment"]
    rows = []
    for relaxation in RELAXATIONS:
        for place, (method, segments, spacing) in enumerate(VARIANTS):
            for row in truth:
                stretch = 1.0 if method == "unoptimized" else 1.05 + 0.01 * place
                rows.append(
                    dict.fromkeys(PLANS_SCHEMA.names)
                    | {
                        "tree_id": row["tree_id"],
                        "relaxation_percent": relaxation,
                        "method": method,
                        "krc_segments": segments,
                        "point_spacing": spacing,
                        "vertex": row["order"],
                        "move": f"move-{row['order']}",
                        "d_min_s": row["duration_fastest_s"],
                        "duration_s": stretch * row["duration_fastest_s"],
                        "speed_limit_percent": 100.0 / stretch,
                        "prior_wait_s": 0.0,
                        "post_wait_s": 0.5 if row["order"] == 2 else 0.0,
                        "collision_wait_s": 0.0,
                        "simulated_energy_j": 1000.0 - 10.0 * place,
                    }
                )
    pq.write_table(pa.Table.from_pylist(rows, schema=PLANS_SCHEMA), data / "plans.parquet")


def gap_rows(name: str, methods: tuple[str, ...]) -> list[dict[str, object]]:
    """Gaps that fall from method to method: 0.8 % for the first one."""
    return [
        {"relaxation_percent": f"{relaxation:g}", name: method}
        | {f"gap_{key}_percent": 0.8 / (1 + place) + add for key, add in GAP.items()}
        | {"saving_mean_percent": 10.0 * place, "above_unoptimized_percent": 0.0, "trees": 3}
        for relaxation in RELAXATIONS
        for place, method in enumerate(methods)
    ]


def write_rows(path: Path, rows: list[dict[str, object]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _write_tables(tables: Path) -> None:
    rows: list[dict[str, object]] = [
        {
            "relaxation_percent": f"{relaxation:g}",
            "krc_segments": segments or "",
            "method": method,
            "saving_percent": f"{10 * place:.4f}",
            "saving_percent_published_convention": f"{11 * place:.4f}",
            "gap_to_optimum_percent": f"{8 - 2 * place:.4f}",
            "trees": 3,
        }
        for relaxation in RELAXATIONS
        for place, (method, segments, spacing) in enumerate(VARIANTS)
        if spacing != "duration"
    ]
    write_rows(tables / "table_6_1.csv", rows)
    claims = [{"claim": "more <segments> help & save", "thesis": "yes", "robojoule": "-1.00 points", "held": "false"}]
    write_rows(tables / "claims.csv", claims)
    idle = {"figure": "idle power [W]", "published": "430", "low": 417.1, "high": 442.9, "robojoule": 512.5}
    write_rows(tables / "energy_model.csv", [idle | {"fitted": "false", "held": "false"}])
    errors: list[dict[str, object]] = [
        {"target": target, "model": model, "error": error} | dict.fromkeys(("p25", "p50", "p75", "max", "mean"), 1.5)
        for target in TARGETS
        for model in ("random_forest", "neural_network")
        for error in ("abs", "rel_percent")
    ]
    write_rows(tables / "table_5_1.csv", errors)
    methods = ("unoptimized", "krc_polynomial_4", "predicted_three_segment", "robojoule_predicted", "optimum")
    write_rows(tables / "gaps.csv", [row | {"runs_per_motion": 2} for row in gap_rows("method", methods)])
    wins = [
        {"relaxation_percent": f"{relaxation:g}", "method": method, "other": other, "wins": 2, "losses": 1, "trees": 3}
        for relaxation in RELAXATIONS
        for method in methods
        for other in methods
        if method != other
    ]
    write_rows(tables / "wins.csv", wins)
    studies = tables.parents[1] / "studies/tables"
    studies.mkdir(parents=True)
    key: dict[str, object] = {"regime": "same_robot", "payload_kg": "all"}
    write_rows(studies / "motions_gaps.csv", [key | row for row in gap_rows("method", methods)])
    write_rows(studies / "motions_wins.csv", [key | row for row in wins])
    steps = {"representation": ("five_runs", "dense"), "idle_power": ("constant",), "predictor": ("mean",)}
    ablations = [{"part": part} | row for part, cases in steps.items() for row in gap_rows("case", cases)]
    write_rows(studies / "ablations.csv", ablations)
    figures = ("late", "gap", "late_nominal", "late_one_ratio")
    machines = [
        {"look": look, "machine": machine, "inside": inside, "trials": trials}
        | {f"{name}_{what}_percent": 0.1 * trials for name in figures for what in ("mean", "worst")}
        for look in ("trace", "stopwatch")
        for machine, inside in (("slower", "true"), ("odd", "false"))
        for trials in (1, 2)
    ]
    write_rows(studies / "closed_loop.csv", machines)
    payloads: list[dict[str, object]] = [
        {
            "payload_kg": payload,
            "relaxation_percent": relaxation,
            "method": method,
            "mean_power_full_speed_w": 1000.0 + payload,
            "saving_percent": 20.0,
        }
        for payload in (0, 10)
        for relaxation in RELAXATIONS
        for method in ("unoptimized", "optimum")
    ]
    write_rows(tables / "payload_sensitivity.csv", payloads)
