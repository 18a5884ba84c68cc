"""The optimum of every simulated motion as a table, by the definitions of `robojoule.profile.parameters`."""

from __future__ import annotations

import duckdb
import numpy as np
import pyarrow as pa

from robojoule.profile.parameters import optimal_run, profile_parameters, steepness


def add_optima(connection: duckdb.DuckDBPyConnection) -> None:
    """Create the table `optima` from the view `runs`, one row per motion.

    Speed limits that give the same run count once, as the lowest of them. Columns beside motion_id:

        optimal_speed_limit_percent  speed limit of the least energy [%]
        optimal_duration_s           its duration [s]
        energy_saving_j              energy of the fastest run less the least energy [J]
        energy_penalty_j             energy of the slowest run less the least energy [J]
        duration_slowest_s, duration_fastest_s   durations of both [s]
        duration_penalty_s           optimal less fastest duration [s]
        steepness_j_per_s            Eq. 4.1 [J/s]; 0 where nothing can be saved, so that such a motion comes last in
                                     the order of suitability
    """
    query = """
        SELECT motion_id, speed_limit_percent, duration_s, energy_j FROM runs
        WHERE "distinct" ORDER BY motion_id, speed_limit_percent
    """
    found = connection.execute(query).fetchnumpy()
    motions, first, counts = np.unique(found["motion_id"], return_index=True, return_counts=True)
    # Motions with fewer distinct runs repeat their last one.
    places = first[:, np.newaxis] + np.minimum(np.arange(counts.max()), counts[:, np.newaxis] - 1)
    limits, duration, energy = (found[name][places] for name in ("speed_limit_percent", "duration_s", "energy_j"))
    parameters = profile_parameters(duration, energy)
    fastest = duration.min(axis=1)
    optima = pa.table(
        {
            "motion_id": motions,
            "optimal_speed_limit_percent": limits[np.arange(len(motions)), optimal_run(duration, energy)],
            "optimal_duration_s": parameters[:, 1],
            "energy_saving_j": parameters[:, 0],
            "energy_penalty_j": parameters[:, 2],
            "duration_slowest_s": duration.max(axis=1),
            "duration_fastest_s": fastest,
            "duration_penalty_s": parameters[:, 1] - fastest,
            "steepness_j_per_s": steepness(parameters, fastest),
        }
    )
    connection.register("optima_of_runs", optima)
    connection.execute("CREATE OR REPLACE TABLE optima AS SELECT * FROM optima_of_runs ORDER BY motion_id")
    connection.unregister("optima_of_runs")
