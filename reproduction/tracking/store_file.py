"""A look into MLflow's store in a file without MLflow, which takes seconds to load."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

_NEWEST = """
SELECT runs.run_uuid, runs.experiment_id, own.value
FROM runs
JOIN experiments ON experiments.experiment_id = runs.experiment_id AND experiments.name = ?
JOIN tags own ON own.run_uuid = runs.run_uuid AND own.key = ?
WHERE runs.status = 'FINISHED' AND runs.lifecycle_stage = 'active' AND {conditions}
ORDER BY runs.start_time DESC LIMIT 1
"""
_TAGGED = "EXISTS (SELECT 1 FROM tags WHERE tags.run_uuid = runs.run_uuid AND tags.key = ? AND tags.value = ?)"


def newest_run(store: Path, experiment: str, wanted: Mapping[str, str], tag: str) -> tuple[str, str, str] | None:
    """Newest finished run with some tags: its id, that of its experiment, and the value of one more tag.

    Args:
        store: The store's SQLite file.
        experiment: Name of the experiment.
        wanted: Tags and their values.
        tag: The tag that is asked for.

    Raises:
        sqlite3.Error: The file cannot be read, or MLflow keeps runs in another way than it did.
    """
    query = _NEWEST.format(conditions=" AND ".join([_TAGGED] * len(wanted)))
    values = [experiment, tag, *(part for pair in wanted.items() for part in pair)]
    with closing(sqlite3.connect(f"{store.as_uri()}?mode=ro", uri=True)) as connection:
        found = connection.execute(query, values).fetchone()
    return None if found is None else (str(found[0]), str(found[1]), str(found[2]))
