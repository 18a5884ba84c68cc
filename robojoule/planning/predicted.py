"""`robojoule_predicted`: plans on predicted profiles and idle power; no run of a new motion is simulated for them."""

from __future__ import annotations

from robojoule.planning.batch import TreeBatch
from robojoule.planning.costs import VertexCosts
from robojoule.profile.predicted import PredictedProfiles


def predicted_costs(
    batch: TreeBatch, predicted: PredictedProfiles, *, cautious: bool = False
) -> list[list[VertexCosts]]:
    """Costs of predicted profiles and idle powers, a list a tree; see `PredictedProfiles.piecewise` for `cautious`."""
    return [
        [
            VertexCosts(
                predicted.piecewise(motion, cautious=cautious),
                float(predicted.idle_start_w[motion]),
                float(predicted.idle_end_w[motion]),
            )
            for motion in range(rows.start, rows.stop)
        ]
        for rows in batch.rows
    ]
