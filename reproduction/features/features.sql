-- Every feature of thesis 4.2, one row per motion: where it belongs, its simulated optimum, its geometry, its joints.
CREATE OR REPLACE TABLE features AS
SELECT
    motions.motion_id,
    tree_id,
    split,
    "order",
    optima.* EXCLUDE (motion_id),
    inputs.* EXCLUDE (motion_id)
FROM motions
JOIN optima USING (motion_id)
JOIN inputs USING (motion_id)
ORDER BY motions.motion_id;
