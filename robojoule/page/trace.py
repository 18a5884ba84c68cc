"""One cycle in time, for drawing: what the robot does when, and the mains power meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun, standing_energies_j
from robojoule.profile.energy_profile import PARTS
from robojoule.programs.operation_tree import MoveOperation, OperationTree, ProcessOperation, WaitOperation
from robojoule.progress import told

_POINTS = 3000  # of the power of a whole cycle, all motions together
_LEAST_POINTS, _MOST_POINTS = 8, 120  # of one motion


@dataclass(frozen=True)
class Step:
    """A part of the cycle.

    Attributes:
        kind: move, wait or process.
        name: Name of the operation; of the move that it stands at for a wait of a move.
        start_s: Its start. [s]
        end_s: Its end. [s]
        power_w: Mean mains power in it. [W]
    """

    kind: str
    name: str
    start_s: float
    end_s: float
    power_w: float


@dataclass(frozen=True, eq=False)
class CycleTrace:
    """One cycle in time.

    Attributes:
        steps: What the robot does, in order.
        time_s: Instants of `power_w`, shape (T,). [s]
        power_w: Mains power, linear between instants, shape (T,). [W]
        parts_j: Where the energy goes: parts of the motions, then standing and process steps. [J]
    """

    steps: tuple[Step, ...]
    time_s: Array
    power_w: Array
    parts_j: dict[str, float]


def cycle_trace(batch: TreeBatch, tree: OperationTree, run: CycleRun, *, sampled: bool) -> CycleTrace:
    """One cycle of a tree in time.

    Args:
        batch: The one tree, whose motions the trace samples.
        tree: It, with the speed limits and waits of the run.
        run: Its simulation, or what is known of it from measured runs.
        sampled: Whether power varies within motions, as simulated; else each has its mean power.
    """
    standing_j, _ = standing_energies_j(
        batch.robot, tree, run.prior_waits_s, run.post_waits_s, batch.idle_prior_w, batch.idle_post_w
    )
    motions_j = run.vertex_energies_j - standing_j
    steps = _steps(tree, run, motions_j, standing_j)
    points = int(np.clip(_POINTS // max(len(run.names), 1), _LEAST_POINTS, _MOST_POINTS))
    times: list[Array] = []
    powers: list[Array] = []
    limits = np.array([move.speed_limit_percent / 100.0 for move in tree.moves()])
    motion = 0
    for step in told("power over the cycle", steps):
        time, power = np.array([step.start_s, step.end_s]), np.full(2, step.power_w)
        if step.kind == "move":
            if sampled and step.end_s > step.start_s:
                time, power = _sampled(batch, motion, limits, step, points)
            motion += 1
        times.append(time)
        powers.append(power)
    parts = _parts_j(batch, limits) if sampled else {"motions_j": float(motions_j.sum())}
    process_j = sum(step.duration_s * step.power_w for step in tree.atomic() if isinstance(step, ProcessOperation))
    parts |= {"standing_j": float(standing_j.sum()), "process_j": process_j}
    return CycleTrace(steps, np.concatenate(times), np.concatenate(powers), parts)


def _steps(tree: OperationTree, run: CycleRun, motions_j: Array, standing_j: Array) -> tuple[Step, ...]:
    waits = run.prior_waits_s + run.post_waits_s
    standing_w = np.divide(standing_j, waits, out=np.zeros_like(waits), where=waits > 0.0)
    moving_w = np.divide(motions_j, run.durations_s, out=np.zeros_like(waits), where=run.durations_s > 0.0)
    steps: list[Step] = []
    vertex = 0

    def add(kind: str, name: str, seconds: float, power_w: float) -> None:
        if seconds > 0.0 or kind == "move":
            start = steps[-1].end_s if steps else 0.0
            steps.append(Step(kind, name, start, start + seconds, power_w))

    for operation in tree.atomic():
        at = max(vertex - 1, 0)  # waits and process steps belong to the motion before them
        if isinstance(operation, MoveOperation):
            at = min(vertex, len(standing_w) - 1)
            add("wait", operation.name, operation.all_before_s, float(standing_w[at]))
            if not operation.is_fine:
                continue
            add("move", operation.name, float(run.durations_s[vertex]), float(moving_w[vertex]))
            add("wait", operation.name, operation.all_after_s, float(standing_w[at]))
            vertex += 1
        elif isinstance(operation, ProcessOperation):
            add("process", operation.name, operation.duration_s, float(standing_w[at]) + operation.power_w)
        elif isinstance(operation, WaitOperation):
            add("wait", operation.name, operation.duration_s, float(standing_w[at]))
    return tuple(steps)


def _sampled(batch: TreeBatch, motion: int, move_limits: Array, step: Step, points: int) -> tuple[Array, Array]:
    """Power within a motion; its instants fill the step, whatever dead time a learnt controller adds."""
    length = step.end_s - step.start_s
    samples = batch.executed.power_samples(motion, move_limits, max(points - 1, 1) / length)
    return step.start_s + samples.time_s * (length / samples.time_s[-1]), samples.power_w


def _parts_j(batch: TreeBatch, move_limits: Array) -> dict[str, float]:
    runs = batch.executed.simulate_moves(move_limits[:, np.newaxis])
    return {part: float(getattr(runs, part).sum()) for part in PARTS}
