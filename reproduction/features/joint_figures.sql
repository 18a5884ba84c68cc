-- How much faster every joint moves in the fastest run than in the slowest one, one row per motion and joint.
-- On a straight joint-space path q(s) = q_start + s (q_end - q_start) every joint figure is |dq_j| times the path
-- figure, taken along the direction of motion; decelerations and jerks are magnitudes.
--   motion_id, joint                      motion and 'j1', 'j2', ...
--   angle_difference_rad                  |dq_j| [rad]
--   speed_difference_rad_s                [rad/s]
--   acceleration_difference_rad_s2        [rad/s^2]
--   deceleration_difference_rad_s2        [rad/s^2]
--   jerk_acceleration_difference_rad_s3   [rad/s^3]
--   jerk_deceleration_difference_rad_s3   [rad/s^3]
-- A motion of length zero has no samples; its differences are 0.
CREATE OR REPLACE TABLE joint_figures AS
WITH differences AS (
    SELECT
        fastest.motion_id,
        fastest.velocity_per_s - slowest.velocity_per_s AS velocity_per_s,
        fastest.acceleration_per_s2 - slowest.acceleration_per_s2 AS acceleration_per_s2,
        fastest.deceleration_per_s2 - slowest.deceleration_per_s2 AS deceleration_per_s2,
        fastest.jerk_acceleration_per_s3 - slowest.jerk_acceleration_per_s3 AS jerk_acceleration_per_s3,
        fastest.jerk_deceleration_per_s3 - slowest.jerk_deceleration_per_s3 AS jerk_deceleration_per_s3
    FROM path_figures AS fastest
    JOIN path_figures AS slowest USING (motion_id)
    WHERE fastest.fast AND NOT slowest.fast
)
SELECT
    joint_travel.motion_id,
    joint,
    travel_rad AS angle_difference_rad,
    coalesce(travel_rad * velocity_per_s, 0) AS speed_difference_rad_s,
    coalesce(travel_rad * acceleration_per_s2, 0) AS acceleration_difference_rad_s2,
    coalesce(travel_rad * deceleration_per_s2, 0) AS deceleration_difference_rad_s2,
    coalesce(travel_rad * jerk_acceleration_per_s3, 0) AS jerk_acceleration_difference_rad_s3,
    coalesce(travel_rad * jerk_deceleration_per_s3, 0) AS jerk_deceleration_difference_rad_s3
FROM joint_travel
LEFT JOIN differences USING (motion_id)
ORDER BY motion_id, joint;
