-- What the thesis's section 4.3 says of the features, beside what the motions show, one row per claim:
--   claim  the statement; thesis  what it says; robojoule  what comes out here; held  whether both agree
CREATE OR REPLACE TABLE claims_features AS
WITH r AS (
    SELECT DISTINCT row_feature AS target, column_feature AS feature, pearson
    FROM correlations
    WHERE row_feature IN ('energy_saving_j', 'duration_penalty_s', 'energy_penalty_j', 'steepness_j_per_s')
      AND pearson IS NOT NULL
),
grouped AS (
    SELECT
        target,
        feature,
        pearson,
        CASE
            WHEN feature IN ('euclidean_distance_m', 'vertical_distance_m', 'horizontal_distance_m') THEN 'distance'
            WHEN feature = 'theta_sum_rad' THEN 'theta'
            WHEN regexp_matches(feature, '^j[1-3]_angle') THEN 'angle_1_3'
            WHEN regexp_matches(feature, '^j[4-9]_angle') THEN 'angle_4_6'
            WHEN regexp_matches(feature, '^j[1-3]_') THEN 'dynamic_1_3'
            WHEN regexp_matches(feature, '^j[4-9]_') THEN 'dynamic_4_6'
        END AS kind
    FROM r
),
facts AS (
    SELECT
        target,
        kind,
        min(pearson) AS least,
        max(pearson) AS most,
        avg(pearson ORDER BY feature) AS mean,
        max(abs(pearson)) AS strongest,
        regexp_extract(arg_max(feature, abs(pearson)), '^j\d') AS strongest_joint,
        printf('%.2f to %.2f', min(pearson), max(pearson)) AS span
    FROM grouped
    WHERE kind IS NOT NULL
    GROUP BY target, kind
),
saving AS (FROM facts WHERE target = 'energy_saving_j'),
penalty AS (FROM facts WHERE target = 'energy_penalty_j'),
delay AS (FROM facts WHERE target = 'duration_penalty_s'),
rising AS (
    SELECT regr_r2(energy_j, duration_s ORDER BY speed_limit_percent) AS straightness
    FROM runs
    JOIN features USING (motion_id)
    WHERE split <> 'experiment' AND "distinct" AND speed_limit_percent < optimal_speed_limit_percent
    GROUP BY motion_id
    HAVING count(*) > 2
),
claims AS (
    SELECT 1 AS place, 'Euclidean, horizontal and vertical distance correlate with the energy saving' AS claim,
           'positive' AS thesis, span AS robojoule, least > 0 AS held
    FROM saving WHERE kind = 'distance'
    UNION ALL
    SELECT 2, 'The sum of joint travel (theta sum) correlates with the energy saving', 'high, positive',
           printf('%.2f', mean), mean > 0.3
    FROM saving WHERE kind = 'theta'
    UNION ALL
    SELECT 3, 'Angle differences of joints 1-3 correlate with the energy saving', 'positive', span, least > 0
    FROM saving WHERE kind = 'angle_1_3'
    UNION ALL
    SELECT 4, 'Of the angle differences of joints 1-3 the strongest is', 'j2', strongest_joint, strongest_joint = 'j2'
    FROM saving WHERE kind = 'angle_1_3'
    UNION ALL
    SELECT 5, 'Angle differences of joints 4-6 correlate with the energy saving', 'negative', span, most < 0
    FROM saving WHERE kind = 'angle_4_6'
    UNION ALL
    SELECT 6, 'Dynamic features of joints 1-3 correlate with the energy saving', 'positive', span, least > 0
    FROM saving WHERE kind = 'dynamic_1_3'
    UNION ALL
    SELECT 7, 'Of the dynamic features of joints 1-3 the strongest belong to', 'j2', strongest_joint,
           strongest_joint = 'j2'
    FROM saving WHERE kind = 'dynamic_1_3'
    UNION ALL
    SELECT 8, 'Dynamic features of joints 4-6 correlate with the energy saving', 'small to moderate negative', span,
           most < 0
    FROM saving WHERE kind = 'dynamic_4_6'
    UNION ALL
    SELECT 9, 'Dynamic features correlate with the duration penalty', 'little to none (taken as |r| < 0.3)',
           printf('|r| up to %.2f', max(strongest)), max(strongest) < 0.3
    FROM delay WHERE starts_with(kind, 'dynamic')
    HAVING count(*) > 0
    UNION ALL
    SELECT 10, 'Distances correlate with the energy penalty slightly weaker than with the saving', 'slightly weaker',
           printf('mean r %.2f against %.2f', penalty.mean, saving.mean),
           penalty.mean > 0 AND penalty.mean < saving.mean
    FROM penalty JOIN saving USING (kind) WHERE kind = 'distance'
    UNION ALL
    SELECT 11, 'Dynamic features of joints 1-3 correlate with the energy penalty against their sign for the saving',
           'opposite sign', printf('mean r %.2f against %.2f', penalty.mean, saving.mean),
           penalty.mean * saving.mean < 0
    FROM penalty JOIN saving USING (kind) WHERE kind = 'dynamic_1_3'
    UNION ALL
    SELECT 12, 'Dynamic features of joints 4-6 correlate with the energy penalty against their sign for the saving',
           'opposite sign', printf('mean r %.2f against %.2f', penalty.mean, saving.mean),
           penalty.mean * saving.mean < 0
    FROM penalty JOIN saving USING (kind) WHERE kind = 'dynamic_4_6'
    UNION ALL
    SELECT 13, 'Features correlate weaker with steepness than with the energy saving', 'weaker',
           printf('mean |r| %.2f against %.2f', avg(abs(pearson) ORDER BY feature) FILTER (target = 'steepness_j_per_s'),
                  avg(abs(pearson) ORDER BY feature) FILTER (target = 'energy_saving_j')),
           avg(abs(pearson) ORDER BY feature) FILTER (target = 'steepness_j_per_s')
               < avg(abs(pearson) ORDER BY feature) FILTER (target = 'energy_saving_j')
    FROM grouped WHERE kind IS NOT NULL
    HAVING count(*) > 0
    UNION ALL
    SELECT 14, 'The increasing segment is linear (R^2 of a line through the runs slower than the optimum)',
           'quite accurately', printf('median %.4f, least %.4f', median(straightness), min(straightness)),
           median(straightness) > 0.99
    FROM rising
    HAVING count(*) > 0
)
SELECT claim, thesis, robojoule, held FROM claims ORDER BY place;
