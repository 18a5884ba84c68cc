"""The whole pipeline, forced, against the bare writing of its Parquet files and the bare fits. Part of `--full`.

It runs in a copy of the project's committed files, so that no result of this folder is touched.
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from benchmarks.measure import rounded, run
from reproduction.config import load_params
from reproduction.layout import Layout
from reproduction.motions.tables import SAMPLES_SCHEMA, samples_writer
from reproduction.predictors.estimators import MODELS, fit, make_estimator
from reproduction.predictors.profile_parameters import input_names, joint_count
from reproduction.tables import columns, write_parquet
from robojoule.profile.parameters import TARGETS


def bare_writing_s(layout: Layout, folder: Path) -> float:
    """Seconds to write every Parquet file of the pipeline again, table by table."""
    seconds = 0.0
    for path in sorted(layout.data_dir.rglob("*.parquet")):
        table, again = pq.read_table(path), folder / path.name
        start = time.perf_counter()
        if table.schema.equals(SAMPLES_SCHEMA):
            with samples_writer(again) as writer:
                writer.write_table(table, row_group_size=1 << 20)
        else:
            write_parquet(again, table)
        seconds += time.perf_counter() - start
    return seconds


def bare_fits_s(root: Path) -> float:
    """Seconds to fit the forest and the network on the training motions, one after the other."""
    layout, params = Layout(root), load_params(root / "params.yaml")
    features = pq.read_table(layout.features)
    features = features.filter(np.array(features["split"].to_pylist()) == "train")
    inputs = features.select(input_names(joint_count(features.column_names))).to_pandas()
    targets = columns(features, TARGETS, layout.features)
    start = time.perf_counter()
    for model in MODELS:
        fit(make_estimator(model, params.train_predictors), inputs, targets)
    return time.perf_counter() - start


def measure(folder: Path) -> dict[str, float]:
    """Run `dvc repro -f`, then the bare work on what it wrote."""
    root, bare = folder / "project", folder / "bare"
    bare.mkdir()
    subprocess.run(["git", "clone", "-q", ".", str(root)], check=True)
    done = run([sys.executable, "-m", "dvc", "repro", "-f"], cwd=root, watch=True)
    work = bare_writing_s(Layout(root), bare) + bare_fits_s(root)
    return rounded(
        {
            "pipeline_over_bare_work": done.seconds / work,
            "pipeline_s": done.seconds,
            "bare_work_s": work,
            "peak_mib": done.peak_mib,
        }
    )
