-- Joint positions, velocities, accelerations, jerks and torques of every sample, as a view over the stored path
-- coordinates: q = start + s (end - start), and torques from the Chebyshev series of data/paths.parquet.
-- Needs the views `samples`, `motions` and `paths`.
CREATE OR REPLACE MACRO chebyshev(coefficients, s) AS
    list_dot_product(
        coefficients,
        list_transform(range(len(coefficients)), lambda k: cos(k * acos(greatest(-1.0, least(1.0, 2.0 * s - 1.0)))))
    );

CREATE OR REPLACE MACRO path_torque(m, c, g, coulomb, viscous, s, s1, s2) AS
    chebyshev(m, s) * s2 + chebyshev(c, s) * s1 * s1 + chebyshev(g, s) + coulomb + viscous * s1;

CREATE OR REPLACE VIEW joint_samples AS
SELECT
    samples.motion_id,
    samples.speed_limit_percent,
    samples.time_s,
    motions.start_q1_rad + path_position * (motions.end_q1_rad - motions.start_q1_rad) AS q1_rad,
    path_velocity_per_s * (motions.end_q1_rad - motions.start_q1_rad) AS q1_velocity_rad_s,
    path_acceleration_per_s2 * (motions.end_q1_rad - motions.start_q1_rad) AS q1_acceleration_rad_s2,
    path_jerk_per_s3 * (motions.end_q1_rad - motions.start_q1_rad) AS q1_jerk_rad_s3,
    path_torque(
        j1_inertia_nm_s2, j1_velocity_nm_s2, j1_gravity_nm, j1_coulomb_nm, j1_viscous_nm_s,
        path_position, path_velocity_per_s, path_acceleration_per_s2
    ) AS q1_torque_nm,
    motions.start_q2_rad + path_position * (motions.end_q2_rad - motions.start_q2_rad) AS q2_rad,
    path_velocity_per_s * (motions.end_q2_rad - motions.start_q2_rad) AS q2_velocity_rad_s,
    path_acceleration_per_s2 * (motions.end_q2_rad - motions.start_q2_rad) AS q2_acceleration_rad_s2,
    path_jerk_per_s3 * (motions.end_q2_rad - motions.start_q2_rad) AS q2_jerk_rad_s3,
    path_torque(
        j2_inertia_nm_s2, j2_velocity_nm_s2, j2_gravity_nm, j2_coulomb_nm, j2_viscous_nm_s,
        path_position, path_velocity_per_s, path_acceleration_per_s2
    ) AS q2_torque_nm,
    motions.start_q3_rad + path_position * (motions.end_q3_rad - motions.start_q3_rad) AS q3_rad,
    path_velocity_per_s * (motions.end_q3_rad - motions.start_q3_rad) AS q3_velocity_rad_s,
    path_acceleration_per_s2 * (motions.end_q3_rad - motions.start_q3_rad) AS q3_acceleration_rad_s2,
    path_jerk_per_s3 * (motions.end_q3_rad - motions.start_q3_rad) AS q3_jerk_rad_s3,
    path_torque(
        j3_inertia_nm_s2, j3_velocity_nm_s2, j3_gravity_nm, j3_coulomb_nm, j3_viscous_nm_s,
        path_position, path_velocity_per_s, path_acceleration_per_s2
    ) AS q3_torque_nm,
    motions.start_q4_rad + path_position * (motions.end_q4_rad - motions.start_q4_rad) AS q4_rad,
    path_velocity_per_s * (motions.end_q4_rad - motions.start_q4_rad) AS q4_velocity_rad_s,
    path_acceleration_per_s2 * (motions.end_q4_rad - motions.start_q4_rad) AS q4_acceleration_rad_s2,
    path_jerk_per_s3 * (motions.end_q4_rad - motions.start_q4_rad) AS q4_jerk_rad_s3,
    path_torque(
        j4_inertia_nm_s2, j4_velocity_nm_s2, j4_gravity_nm, j4_coulomb_nm, j4_viscous_nm_s,
        path_position, path_velocity_per_s, path_acceleration_per_s2
    ) AS q4_torque_nm,
    motions.start_q5_rad + path_position * (motions.end_q5_rad - motions.start_q5_rad) AS q5_rad,
    path_velocity_per_s * (motions.end_q5_rad - motions.start_q5_rad) AS q5_velocity_rad_s,
    path_acceleration_per_s2 * (motions.end_q5_rad - motions.start_q5_rad) AS q5_acceleration_rad_s2,
    path_jerk_per_s3 * (motions.end_q5_rad - motions.start_q5_rad) AS q5_jerk_rad_s3,
    path_torque(
        j5_inertia_nm_s2, j5_velocity_nm_s2, j5_gravity_nm, j5_coulomb_nm, j5_viscous_nm_s,
        path_position, path_velocity_per_s, path_acceleration_per_s2
    ) AS q5_torque_nm,
    motions.start_q6_rad + path_position * (motions.end_q6_rad - motions.start_q6_rad) AS q6_rad,
    path_velocity_per_s * (motions.end_q6_rad - motions.start_q6_rad) AS q6_velocity_rad_s,
    path_acceleration_per_s2 * (motions.end_q6_rad - motions.start_q6_rad) AS q6_acceleration_rad_s2,
    path_jerk_per_s3 * (motions.end_q6_rad - motions.start_q6_rad) AS q6_jerk_rad_s3,
    path_torque(
        j6_inertia_nm_s2, j6_velocity_nm_s2, j6_gravity_nm, j6_coulomb_nm, j6_viscous_nm_s,
        path_position, path_velocity_per_s, path_acceleration_per_s2
    ) AS q6_torque_nm,
    samples.power_w
FROM samples
JOIN motions USING (motion_id)
JOIN paths USING (motion_id);
