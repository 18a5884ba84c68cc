"""The schedule of a cycle: how long each movement takes and where the robot waits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from robojoule.arrays import Array, frozen
from robojoule.errors import CycleTimeTooShort
from robojoule.planning.graph import OptimizationGraph

RELATIVE_GAP = 1e-9  # between a schedule and its proven bound, at which a search ends
# A cycle time this much too short is rounding (messages print microseconds), not a demand.
CYCLE_TIME_TOLERANCE_S = 5e-7


@dataclass(frozen=True, eq=False)
class Schedule:
    """Durations and waits of one cycle, in the order of the graph's vertices; immutable.

    Attributes:
        status: "optimal" (proven), or "rule" (made by a rule, without proof).
        cycle_time_s: Cycle time. [s]
        durations_s: Duration of each movement, shape (V,). [s]
        prior_waits_s: Wait before each movement, shape (V,). [s]
        post_waits_s: Wait after each movement, shape (V,). [s]
        collision_waits_s: Further wait after each movement for a collision to clear, shape (V,). [s]
        starts_s: Start of each movement, shape (V,). [s]
        energy_j: Energy of the cycle as the method sees it; NaN if it does not know. [J]
        bound_j: Proven lower bound of `energy_j`; NaN without proof. [J]
    """

    status: str
    cycle_time_s: float
    durations_s: Array
    prior_waits_s: Array
    post_waits_s: Array
    collision_waits_s: Array
    starts_s: Array
    energy_j: float = float("nan")
    bound_j: float = float("nan")

    def __post_init__(self) -> None:
        for field in ("durations_s", "prior_waits_s", "post_waits_s", "collision_waits_s", "starts_s"):
            object.__setattr__(self, field, frozen(getattr(self, field)))


def check_cycle_time(graph: OptimizationGraph, least_durations_s: Sequence[float] | Array, cycle_time_s: float) -> None:
    """Refuse a cycle time in which the fastest cycle does not fit.

    Args:
        graph: Optimisation graph.
        least_durations_s: Shortest duration of each vertex. [s]
        cycle_time_s: Cycle time asked for. [s]

    Raises:
        CycleTimeTooShort: With the least feasible cycle time.
    """
    least = graph.least_cycle_s([float(d) for d in least_durations_s])
    if not cycle_time_s >= least - CYCLE_TIME_TOLERANCE_S:  # also refuses NaN
        raise CycleTimeTooShort(cycle_time_s, least)
