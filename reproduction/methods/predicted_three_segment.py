"""`predicted_three_segment`: the thesis's predictor, which plans on three-segment profiles from three numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from reproduction.methods.method import MethodPlans, Planner, Variant, plans_by_costs
from reproduction.methods.three_segment_profile import ThreeSegmentShape, three_segments
from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.costs import VertexCosts, joined_costs
from robojoule.planning.solver import model_plans

PREDICTOR_RUNS = 2  # runs (fastest, slowest) from which the predictor takes its features
# Of plans that are equal for the three-segment profile, whose rising slope is its idle power, take the one that waits.
WAIT_PREFERENCE_W = 1e-4


@dataclass(frozen=True, eq=False)
class PredictedThreeSegment:
    """Planning on three-segment profiles.

    Attributes:
        parameters: Predicted saving [J], optimal duration [s] and penalty [J] of each motion, shape (M, 3).
        shape: Constants of the form.
        planner: Solves the planning model.
    """

    parameters: Array
    shape: ThreeSegmentShape
    planner: Planner = model_plans
    variant: ClassVar[Variant] = Variant("predicted_three_segment")

    def plan(self, batch: TreeBatch, cycle_times_s: Array) -> MethodPlans:
        """Plan every tree; see `Method.plan`."""
        return plans_by_costs(
            batch,
            self.costs(batch),
            cycle_times_s,
            self.planner,
            runs_per_motion=PREDICTOR_RUNS,
            preference_w=WAIT_PREFERENCE_W,
        )

    def costs(self, batch: TreeBatch) -> list[list[VertexCosts]]:
        """What the method believes of each tree's vertices."""
        saving, d_opt, penalty = self.parameters.T
        return [
            three_segment_costs(
                batch.d_min_s[rows], d_opt[rows], batch.d_max_s[rows], saving[rows], penalty[rows], self.shape
            )
            for rows in batch.rows
        ]


def three_segment_costs(
    d_min_s: ArrayLike,
    d_opt_s: ArrayLike,
    d_max_s: ArrayLike,
    saving_j: ArrayLike,
    penalty_j: ArrayLike,
    shape: ThreeSegmentShape,
) -> list[VertexCosts]:
    """Costs as the thesis predicts them, for the vertices of one cycle in order: Eq. 5.11, idle power from its slope.

    A vertex whose profile has no rising line (a motion of zero length) takes the idle power of the vertex before it.

    Args:
        d_min_s: Duration at full speed, shape (V,). [s]
        d_opt_s: Predicted optimal duration, shape (V,). [s]
        d_max_s: Duration at the slowest speed limit, shape (V,). [s]
        saving_j: Predicted saving, shape (V,). [J]
        penalty_j: Predicted penalty, shape (V,). [J]
        shape: Constants of the form.

    Raises:
        InputError: No vertex has a rising line.
    """
    columns = np.array([d_min_s, d_opt_s, d_max_s, saving_j, penalty_j], dtype=float).T.tolist()
    built = [
        three_segments(d_min, d_opt, d_max, saving, penalty, shape) for d_min, d_opt, d_max, saving, penalty in columns
    ]
    idle = [slope for _, slope in built]
    if not any(slope > 0.0 for slope in idle):
        raise InputError("no motion of the cycle has a rising energy profile, from which idle power could be taken")
    filled = []
    for v in range(len(idle)):
        before = (idle[(v - back) % len(idle)] for back in range(len(idle)))
        filled.append(next(slope for slope in before if slope > 0.0))
    return joined_costs([profile for profile, _ in built], filled, filled)
