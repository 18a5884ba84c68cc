-- Forward and reverse profiles of the same path compared: a tree visits its points and goes back through them, so its
-- k-th motion and its k-th last one are the same path in both directions. One row per quantity:
--   quantity                              saving, optimal duration, penalty, fastest duration
--   pairs                                 pairs of motions
--   pearson                               correlation of the forward with the reverse value
--   mean_forward, mean_reverse            means in the quantity's unit
--   mean_difference                       mean of reverse minus forward
--   abs_difference_p25 .. _max            quantiles of |reverse - forward|
--   pearson_with_rise                     correlation of (reverse - forward) with the height the tool gains on the way
--                                         forward: what gravity does to the difference
CREATE OR REPLACE TABLE retrace AS
WITH placed AS (
    SELECT
        features.*,
        end_z_m - start_z_m AS rise_m,
        row_number() OVER (PARTITION BY features.tree_id ORDER BY features."order") AS place,
        count(*) OVER (PARTITION BY features.tree_id) AS motions_of_tree
    FROM features
    JOIN motions USING (motion_id)
    WHERE features.split <> 'experiment'
),
pairs AS (
    SELECT
        forward.motion_id,
        forward.rise_m,
        quantity.name AS quantity,
        quantity.place AS quantity_place,
        quantity.forward_value,
        quantity.reverse_value
    FROM placed AS forward
    JOIN placed AS reverse
        ON reverse.tree_id = forward.tree_id
        AND reverse.place = forward.motions_of_tree + 1 - forward.place
        AND forward.place < reverse.place,
    LATERAL (
        SELECT unnest([
            {'place': 1, 'name': 'energy_saving_j',
             'forward_value': forward.energy_saving_j, 'reverse_value': reverse.energy_saving_j},
            {'place': 2, 'name': 'optimal_duration_s',
             'forward_value': forward.optimal_duration_s, 'reverse_value': reverse.optimal_duration_s},
            {'place': 3, 'name': 'energy_penalty_j',
             'forward_value': forward.energy_penalty_j, 'reverse_value': reverse.energy_penalty_j},
            {'place': 4, 'name': 'duration_fastest_s',
             'forward_value': forward.duration_fastest_s, 'reverse_value': reverse.duration_fastest_s}
        ], recursive := true)
    ) AS quantity
),
summary AS (
    SELECT
        quantity,
        quantity_place,
        count(*) AS pairs,
        corr(forward_value, reverse_value ORDER BY motion_id) AS pearson,
        avg(forward_value ORDER BY motion_id) AS mean_forward,
        avg(reverse_value ORDER BY motion_id) AS mean_reverse,
        avg(reverse_value - forward_value ORDER BY motion_id) AS mean_difference,
        quantile_cont(abs(reverse_value - forward_value), [0.25, 0.5, 0.75, 1.0]) AS quantiles,
        corr(reverse_value - forward_value, rise_m ORDER BY motion_id) AS pearson_with_rise
    FROM pairs
    GROUP BY quantity, quantity_place
)
SELECT
    quantity,
    pairs,
    CASE WHEN isfinite(pearson) THEN round(pearson, 6) END AS pearson,
    round(mean_forward, 6) AS mean_forward,
    round(mean_reverse, 6) AS mean_reverse,
    round(mean_difference, 6) AS mean_difference,
    round(quantiles[1], 6) AS abs_difference_p25,
    round(quantiles[2], 6) AS abs_difference_p50,
    round(quantiles[3], 6) AS abs_difference_p75,
    round(quantiles[4], 6) AS abs_difference_max,
    CASE WHEN isfinite(pearson_with_rise) THEN round(pearson_with_rise, 6) END AS pearson_with_rise
FROM summary
ORDER BY quantity_place;
