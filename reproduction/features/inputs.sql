-- What is known of a motion without its energy, one row per motion: the geometry and every joint's figures side by side
-- (columns j1_angle_difference_rad, j1_speed_difference_rad_s, ... for as many joints as the robot has).
CREATE OR REPLACE TABLE inputs AS
WITH joints AS (
    PIVOT joint_figures ON joint USING
        any_value(angle_difference_rad) AS angle_difference_rad,
        any_value(speed_difference_rad_s) AS speed_difference_rad_s,
        any_value(acceleration_difference_rad_s2) AS acceleration_difference_rad_s2,
        any_value(deceleration_difference_rad_s2) AS deceleration_difference_rad_s2,
        any_value(jerk_acceleration_difference_rad_s3) AS jerk_acceleration_difference_rad_s3,
        any_value(jerk_deceleration_difference_rad_s3) AS jerk_deceleration_difference_rad_s3
    GROUP BY motion_id
)
SELECT * FROM geometry JOIN joints USING (motion_id) ORDER BY motion_id;
