"""Features, targets, correlations and the forward and reverse comparison, in DuckDB SQL."""

from __future__ import annotations

import pyarrow.parquet as pq

from reproduction import features
from reproduction.claims import Claim, write_claims
from reproduction.config import Params, load_params
from reproduction.layout import Layout
from robojoule.documents import atomic_path
from stages.cli import run, say


def build_features(params: Params, layout: Layout) -> None:
    """Compute the features of every motion and what they show, from the motions, runs and samples."""
    progress = say("build_features")
    connection = features.connect(layout.motions, layout.samples_dir / "*.parquet", layout.runs)
    for table in (*features.FEATURE_TABLES, *features.FINDING_TABLES):
        features.build(connection, (table,))
        rows = connection.table(table).count("*").fetchall()[0][0]
        progress(f"{table}, {rows} rows")
    with atomic_path(layout.features) as path:
        pq.write_table(features.fetch(connection, "features"), path)
    for table in ("correlations", "retrace"):
        with atomic_path(layout.tables_dir / f"{table}.csv") as path:
            connection.table(table).write_csv(str(path))
    write_claims(layout.feature_claims, [Claim(*row) for row in connection.table("claims_features").fetchall()])


if __name__ == "__main__":
    run(build_features, load_params)
