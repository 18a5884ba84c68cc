-- Correlation matrices of Figures 4.5-4.7 in long form, one row per pair of features: block (static, dynamic_1_3,
-- dynamic_4_6: joints 1-3 and those beyond), row_feature, column_feature, pearson. Experiment trees are left out.
-- Rows and columns stand in the order of the features table; a feature that never varies has no correlation (null).
-- The ordered aggregate makes the last digits independent of how the rows arrive.
CREATE OR REPLACE TABLE correlations AS
WITH long AS (
    UNPIVOT (SELECT * EXCLUDE (tree_id, "order") FROM features WHERE split <> 'experiment')
    ON * EXCLUDE (motion_id, split) INTO NAME feature VALUE figure
),
names AS (
    SELECT column_name AS feature, column_index AS place
    FROM duckdb_columns()
    WHERE table_name = 'features'
),
blocks AS (
    SELECT 'static' AS block, 1 AS block_place, feature, place FROM names
    WHERE regexp_matches(feature, '^(energy|duration|steepness|theta|rotation|euclidean|vertical|horizontal)_'
                                  '|^optimal_duration_s$|^j\d+_angle_')
    UNION ALL
    SELECT 'dynamic_1_3', 2, feature, place FROM names
    WHERE regexp_matches(feature, '^(energy_|duration_penalty|steepness)|^j[1-3]_(speed|acceleration|deceleration|jerk)')
    UNION ALL
    SELECT 'dynamic_4_6', 3, feature, place FROM names
    WHERE regexp_matches(feature, '^(energy_|duration_penalty|steepness)|^j[4-9]_(speed|acceleration|deceleration|jerk)')
),
pairs AS (
    SELECT DISTINCT a.feature AS feature, b.feature AS other
    FROM blocks AS a
    JOIN blocks AS b ON a.block = b.block AND a.place < b.place
),
half AS (
    SELECT pairs.feature, pairs.other, corr(a.figure, b.figure ORDER BY a.motion_id) AS pearson
    FROM pairs
    JOIN long AS a ON a.feature = pairs.feature
    JOIN long AS b ON b.feature = pairs.other AND b.motion_id = a.motion_id
    GROUP BY pairs.feature, pairs.other
),
whole AS (
    SELECT feature, other, pearson FROM half
    UNION ALL
    SELECT other, feature, pearson FROM half
)
SELECT
    a.block,
    a.feature AS row_feature,
    b.feature AS column_feature,
    CASE
        WHEN a.feature = b.feature THEN 1
        WHEN isfinite(whole.pearson) THEN round(whole.pearson, 6)
    END AS pearson
FROM blocks AS a
JOIN blocks AS b USING (block)
LEFT JOIN whole ON whole.feature = a.feature AND whole.other = b.feature
ORDER BY a.block_place, a.place, b.place;
