-- The measured optimum of every motion, one row a motion.
--   optimal_speed_limit_percent  speed limit of least energy [%]
--   optimal_duration_s           its duration [s]
--   energy_saving_j              energy at 100 % minus least energy [J]
--   energy_penalty_j             energy at the slowest speed limit minus least energy [J]
--   duration_slowest_s, duration_fastest_s   durations at the slowest and at the fastest speed limit [s]
--   duration_penalty_s           optimal minus fastest duration [s]
--   steepness_j_per_s            Eq. 4.1, saving / duration penalty [J/s]; 0 where nothing can be saved, so that such
--                                a motion comes last in the order of suitability
-- Speed limits that give the same run count once, as the lowest of them. Of equal energies the faster run is optimal.
CREATE OR REPLACE TABLE optima AS
WITH extremes AS (
    SELECT
        motion_id,
        arg_min({'percent': speed_limit_percent, 'duration_s': duration_s, 'energy_j': energy_j},
                (energy_j, duration_s)) AS best,
        arg_max({'duration_s': duration_s, 'energy_j': energy_j}, speed_limit_percent) AS fastest,
        arg_min({'duration_s': duration_s, 'energy_j': energy_j}, speed_limit_percent) AS slowest
    FROM runs
    WHERE "distinct"
    GROUP BY motion_id
)
SELECT
    motion_id,
    best.percent AS optimal_speed_limit_percent,
    best.duration_s AS optimal_duration_s,
    fastest.energy_j - best.energy_j AS energy_saving_j,
    slowest.energy_j - best.energy_j AS energy_penalty_j,
    slowest.duration_s AS duration_slowest_s,
    fastest.duration_s AS duration_fastest_s,
    best.duration_s - fastest.duration_s AS duration_penalty_s,
    CASE
        WHEN best.duration_s > fastest.duration_s
            THEN (fastest.energy_j - best.energy_j) / (best.duration_s - fastest.duration_s)
        ELSE 0
    END AS steepness_j_per_s
FROM extremes
ORDER BY motion_id;
