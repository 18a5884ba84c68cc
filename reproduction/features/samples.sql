-- Joint positions, velocities, accelerations, jerks and torques of every sample, as the view `joint_samples` over the
-- stored path coordinates: q = start + s (end - start), and torques from the Chebyshev series of data/paths.parquet;
-- q1_rad, q1_velocity_rad_s, ... for as many joints as the motions have.
-- Needs the views `samples`, `motions` and `paths`; makes the table `joint_paths`: one row per motion, one struct per joint.
CREATE OR REPLACE TABLE joint_paths AS
WITH lists AS (
    SELECT
        motion_id,
        [*COLUMNS('^start_q\d+_rad$')] AS start_rad,
        [*COLUMNS('^end_q\d+_rad$')] AS end_rad,
        [*COLUMNS('^j\d+_inertia_nm_s2$')] AS inertia,
        [*COLUMNS('^j\d+_velocity_nm_s2$')] AS velocity,
        [*COLUMNS('^j\d+_gravity_nm$')] AS gravity,
        [*COLUMNS('^j\d+_coulomb_nm$')] AS coulomb,
        [*COLUMNS('^j\d+_viscous_nm_s$')] AS viscous
    FROM motions
    JOIN paths USING (motion_id)
),
joints AS (
    SELECT
        motion_id,
        'q' || joint AS name,
        {
            start_rad: start_rad[joint],
            travel_rad: end_rad[joint] - start_rad[joint],
            inertia: inertia[joint],
            velocity: velocity[joint],
            gravity: gravity[joint],
            coulomb: coulomb[joint],
            viscous: viscous[joint]
        } AS path
    FROM (SELECT *, unnest(range(1, len(start_rad) + 1)) AS joint FROM lists)
)
PIVOT joints ON name USING any_value(path) GROUP BY motion_id;

CREATE OR REPLACE MACRO chebyshev(coefficients, s) AS
    list_dot_product(
        coefficients,
        list_transform(range(len(coefficients)), lambda k: cos(k * acos(greatest(-1.0, least(1.0, 2.0 * s - 1.0)))))
    );

CREATE OR REPLACE MACRO path_torque(path, s, s1, s2) AS
    chebyshev(path.inertia, s) * s2 + chebyshev(path.velocity, s) * s1 * s1 + chebyshev(path.gravity, s)
        + path.coulomb + path.viscous * s1;

CREATE OR REPLACE MACRO path_rad(path, s) AS path.start_rad + s * path.travel_rad;
CREATE OR REPLACE MACRO path_change_rad(path, derivative) AS derivative * path.travel_rad;

CREATE OR REPLACE VIEW joint_samples AS
SELECT
    motion_id,
    speed_limit_percent,
    time_s,
    path_rad(COLUMNS('^(q\d+)$'), path_position) AS '\1_rad',
    path_change_rad(COLUMNS('^(q\d+)$'), path_velocity_per_s) AS '\1_velocity_rad_s',
    path_change_rad(COLUMNS('^(q\d+)$'), path_acceleration_per_s2) AS '\1_acceleration_rad_s2',
    path_change_rad(COLUMNS('^(q\d+)$'), path_jerk_per_s3) AS '\1_jerk_rad_s3',
    path_torque(
        COLUMNS('^(q\d+)$'), path_position, path_velocity_per_s, path_acceleration_per_s2
    ) AS '\1_torque_nm',
    power_w
FROM samples
JOIN joint_paths USING (motion_id);
