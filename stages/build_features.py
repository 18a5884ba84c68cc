"""Features, targets, correlations and the forward and reverse comparison, in DuckDB SQL."""

from __future__ import annotations

import pyarrow.parquet as pq

from reproduction import features
from reproduction.claims.features import feature_claims
from reproduction.config import Params
from reproduction.tables import write_csv
from robojoule.documents import atomic_path
from stages._cli import run
from stages.layout import Layout


def build_features(params: Params, layout: Layout) -> None:
    """Compute the features of every motion and what they show, from the motions, runs and samples."""
    connection = features.connect(layout.motions, layout.samples_dir / "*.parquet", layout.runs)
    for table in (*features.FEATURE_TABLES, *features.FINDING_TABLES):
        features.build(connection, (table,))
        rows = connection.table(table).count("*").fetchall()[0][0]
        print(f"build_features: {table}, {rows} rows", flush=True)
    with atomic_path(layout.features) as path:
        pq.write_table(features.fetch(connection, "features"), path)
    write_csv(layout.tables_dir / "claims_features.csv", [claim.row() for claim in feature_claims(connection)])
    for table in ("correlations", "retrace"):
        with atomic_path(layout.tables_dir / f"{table}.csv") as path:
            connection.table(table).write_csv(str(path))


def main() -> None:
    """Run the stage from the command line."""
    run(build_features)


if __name__ == "__main__":
    main()
