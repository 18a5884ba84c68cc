-- What every motion is in space, one row per motion.
--   theta_sum_rad          sum of all joints' travel [rad]
--   rotation_angle_rad     angle between the tool's start and end orientation, 0..pi [rad]
--   euclidean_distance_m   distance of the tool's end position from its start [m]
--   vertical_distance_m    |dz| [m]
--   horizontal_distance_m  distance in the x-y plane [m]
-- The angle between unit quaternions is taken from their chord (4 asin(chord / 2), of both signs the nearer one):
-- unlike acos of the scalar product it keeps its digits near 0.
CREATE OR REPLACE TABLE geometry AS
WITH travel AS (
    SELECT motion_id, sum(travel_rad ORDER BY joint) AS theta_sum_rad FROM joint_travel GROUP BY motion_id
),
steps AS (
    SELECT
        motion_id,
        end_x_m - start_x_m AS dx_m,
        end_y_m - start_y_m AS dy_m,
        end_z_m - start_z_m AS dz_m,
        (end_qw - start_qw) ^ 2 + (end_qx - start_qx) ^ 2
            + (end_qy - start_qy) ^ 2 + (end_qz - start_qz) ^ 2 AS squared_chord,
        (end_qw + start_qw) ^ 2 + (end_qx + start_qx) ^ 2
            + (end_qy + start_qy) ^ 2 + (end_qz + start_qz) ^ 2 AS squared_chord_negated
    FROM motions
)
SELECT
    motion_id,
    theta_sum_rad,
    4 * asin(least(1, sqrt(least(squared_chord, squared_chord_negated)) / 2)) AS rotation_angle_rad,
    sqrt(dx_m ^ 2 + dy_m ^ 2 + dz_m ^ 2) AS euclidean_distance_m,
    abs(dz_m) AS vertical_distance_m,
    sqrt(dx_m ^ 2 + dy_m ^ 2) AS horizontal_distance_m
FROM steps
JOIN travel USING (motion_id)
ORDER BY motion_id;
