-- Largest path figures of the fastest and the slowest run of every motion, one row per motion and run.
--   motion_id                       motion
--   fast                            true: the fastest run (100 %); false: the slowest one (10 %)
--   velocity_per_s                  largest path velocity [1/s]
--   acceleration_per_s2             largest path acceleration while accelerating [1/s^2]
--   deceleration_per_s2             largest |path acceleration| while decelerating [1/s^2]
--   jerk_acceleration_per_s3        largest path jerk while accelerating [1/s^3]
--   jerk_deceleration_per_s3        largest |path jerk| while decelerating [1/s^3]
-- Largest values do not depend on the order of the rows, so this is the one aggregate over all samples.
-- The two speed limits are constants of the connection: the scan skips every other run before it reads a figure.
CREATE OR REPLACE TABLE path_figures AS
SELECT
    motion_id,
    speed_limit_percent = getvariable('fastest_percent')::FLOAT AS fast,
    max(path_velocity_per_s)::DOUBLE AS velocity_per_s,
    coalesce(max(path_acceleration_per_s2) FILTER (path_acceleration_per_s2 > 0), 0)::DOUBLE AS acceleration_per_s2,
    coalesce(max(-path_acceleration_per_s2) FILTER (path_acceleration_per_s2 < 0), 0)::DOUBLE AS deceleration_per_s2,
    coalesce(max(path_jerk_per_s3) FILTER (path_acceleration_per_s2 > 0), 0)::DOUBLE AS jerk_acceleration_per_s3,
    coalesce(max(abs(path_jerk_per_s3)) FILTER (path_acceleration_per_s2 < 0), 0)::DOUBLE AS jerk_deceleration_per_s3
FROM samples
WHERE speed_limit_percent IN (getvariable('slowest_percent')::FLOAT, getvariable('fastest_percent')::FLOAT)
GROUP BY motion_id, fast
ORDER BY motion_id, fast;
