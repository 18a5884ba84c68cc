-- Joint travel of every motion, one row per motion and joint.
--   motion_id   motion
--   joint       'j1', 'j2', ...; as many as the motions have joints
--   travel_rad  |q_end - q_start| [rad]
CREATE OR REPLACE TABLE joint_travel AS
WITH starts AS (
    UNPIVOT (SELECT motion_id, COLUMNS('^start_q\d+_rad$') FROM motions)
    ON * EXCLUDE (motion_id) INTO NAME column_name VALUE position_rad
),
ends AS (
    UNPIVOT (SELECT motion_id, COLUMNS('^end_q\d+_rad$') FROM motions)
    ON * EXCLUDE (motion_id) INTO NAME column_name VALUE position_rad
)
SELECT
    starts.motion_id,
    'j' || regexp_extract(starts.column_name, '\d+') AS joint,
    abs(ends.position_rad - starts.position_rad) AS travel_rad
FROM starts
JOIN ends
    ON ends.motion_id = starts.motion_id
    AND ends.column_name = replace(starts.column_name, 'start_', 'end_')
ORDER BY starts.motion_id, joint;
