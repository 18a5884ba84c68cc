"""What the thesis's section 4.3 says of the features, beside what the motions show."""

from __future__ import annotations

import duckdb

from reproduction.claims import Claim


def feature_claims(connection: duckdb.DuckDBPyConnection) -> list[Claim]:
    """Claims as `claims_features.sql` judged them; those without data are left out.

    Args:
        connection: Database with the table `claims_features`, see `reproduction.features`.
    """
    return [Claim(*row) for row in connection.table("claims_features").fetchall()]
