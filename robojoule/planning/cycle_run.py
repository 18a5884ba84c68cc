"""Simulation of trees as they stand: what one cycle takes, move by move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from robojoule.arrays import Array, freeze
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionRuns
from robojoule.planning.batch import TreeBatch, percent_of
from robojoule.planning.graph import graph_of_tree, process_energy_j
from robojoule.planning.standstills import standing
from robojoule.planning.tree_motions import closes
from robojoule.profile.energy_profile import rms_torque_warning, torque_warning
from robojoule.programs.operation_tree import MoveOperation, OperationTree, ProcessOperation
from robojoule.robots.robot import Robot
from robojoule.robots.standby import StandbyMode, standing_energy_j

OPEN_CYCLE = "the cycle ends elsewhere than it starts: the way back is not part of it"


@dataclass(frozen=True)
class MoveRun:
    """One move of a simulated cycle.

    Attributes:
        name: Name of the move.
        speed_limit_percent: Share of the joint velocity limits that it may use. [%]
        duration_s: Duration of the movement. [s]
        wait_before_s: Time that the robot stands before it. [s]
        wait_after_s: Time that the robot stands after it, process steps included. [s]
        energy_j: Energy of the movement and of standing before and after it. [J]
        peak_power_w: Largest mains power during the movement; 0 where nothing moves. [W]
        peak_torque_ratio: Largest joint torque over its peak limit during the movement; 0 where nothing moves. [-]
        through: Names of the coarse moves before it that belong to the same motion; its figures are those of all, its
            speed limit is the highest of all.
    """

    name: str
    speed_limit_percent: float
    duration_s: float
    wait_before_s: float
    wait_after_s: float
    energy_j: float
    peak_power_w: float
    peak_torque_ratio: float
    through: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class CycleRun:
    """Simulation of one cycle of a tree, in the order of its vertices.

    Attributes:
        names: Name of each motion, V of them.
        speed_limits: Speed limit of each motion, shape (V,), fractions in (0, 1].
        durations_s: Shape (V,). [s]
        prior_waits_s: Wait before each motion, shape (V,). [s]
        post_waits_s: Wait after each motion, shape (V,). [s]
        vertex_energies_j: Energy of each motion with its waits, shape (V,). [J]
        peak_powers_w: Largest mains power of each motion, shape (V,). [W]
        peak_torque_ratios: Largest joint torque over its peak limit in each motion, shape (V,). [-]
        rms_torque_ratio: Largest root mean square of a joint torque over the cycle, over its continuous limit. [-]
        energy_j: Energy of the cycle with waits and process steps. [J]
        cycle_time_s: Length of the cycle. [s]
        peak_power_w: Largest mains power of the cycle: of motions, of standing and of process steps. [W]
        standby_saving_j: What standby modes save on its waits against motors that hold. [J]
        standby: Those modes; none: motors hold.
        end_standing_s: How long the robot stands at the end of the cycle, and on into the next one. [s]
        warnings: What to know about it, a sentence each, where a program was simulated for itself.
        through: Names of the coarse moves that each motion goes through; of none if empty.
    """

    names: tuple[str, ...]
    speed_limits: Array
    durations_s: Array
    prior_waits_s: Array
    post_waits_s: Array
    vertex_energies_j: Array
    peak_powers_w: Array
    peak_torque_ratios: Array
    rms_torque_ratio: float
    energy_j: float
    cycle_time_s: float
    peak_power_w: float
    standby_saving_j: float = 0.0
    standby: tuple[StandbyMode, ...] = ()
    end_standing_s: float = 0.0
    warnings: tuple[str, ...] = ()
    through: tuple[tuple[str, ...], ...] = ()

    def __post_init__(self) -> None:
        freeze(self)

    def __repr__(self) -> str:
        return (
            f"CycleRun(moves={len(self.names)}, cycle_time_s={self.cycle_time_s:.6g}, energy_j={self.energy_j:.6g}, "
            f"peak_power_w={self.peak_power_w:.6g}, peak_torque_ratio={self.peak_torque_ratio:.4g})"
        )

    @property
    def peak_torque_ratio(self) -> float:
        """Largest joint torque over its peak limit in the cycle. [-]"""
        return float(self.peak_torque_ratios.max(initial=0.0))

    @property
    def moves(self) -> tuple[MoveRun, ...]:
        """The moves in order of execution."""
        columns = (
            np.array([percent_of(float(limit)) for limit in self.speed_limits]),
            self.durations_s,
            self.prior_waits_s,
            self.post_waits_s,
            self.vertex_energies_j,
            self.peak_powers_w,
            self.peak_torque_ratios,
        )
        through = self.through or ((),) * len(self.names)
        return tuple(
            MoveRun(*row) for row in zip(self.names, *(column.tolist() for column in columns), through, strict=True)
        )

    def to_dict(self) -> dict[str, Any]:
        """The cycle as plain data, ready for JSON."""
        return {
            "cycle_time_s": self.cycle_time_s,
            "energy_j": self.energy_j,
            "peak_torque_ratio": self.peak_torque_ratio,
            "rms_torque_ratio": self.rms_torque_ratio,
            "peak_power_w": self.peak_power_w,
            "standby_saving_j": self.standby_saving_j,
            "moves": [asdict(move) | {"through": list(move.through)} for move in self.moves],
            "warnings": list(self.warnings),
        }


def simulate_trees(batch: TreeBatch, written: Sequence[Sequence[OperationTree]]) -> list[list[CycleRun]]:
    """Simulate trees as they stand: their speed limits, waits and process steps.

    Args:
        batch: The trees before planning; the written ones must have the same configurations.
        written: K written trees for each tree of the batch.

    Returns:
        K runs for each tree.

    Raises:
        InputError: A written tree goes elsewhere than the batch's.
    """
    for tree, variants in zip(batch.trees, written, strict=True):
        for variant in variants:
            if not np.array_equal(variant.configurations_rad(), tree.configurations_rad()):
                raise InputError(f"the written tree does not visit the configurations of '{tree.name}'")
    limits = np.concatenate(
        [
            np.array([[move.speed_limit_percent / 100.0 for move in variant.moves()] for variant in variants]).T
            for variants in written
        ]
    )
    runs = batch.executed.simulate_moves(limits)
    return [
        [_cycle_run(batch, runs, rows, k, variant) for k, variant in enumerate(variants)]
        for rows, variants in zip(batch.rows, written, strict=True)
    ]


def cycle_warnings(tree: OperationTree, run: CycleRun) -> tuple[str, ...]:
    """What to know about a simulated cycle, a sentence each: torques beyond a limit, a cycle that does not close."""
    found = [*peak_warnings(run)]
    if run.rms_torque_ratio > 1.0:
        found.append(rms_torque_warning(run.rms_torque_ratio))
    if not closes(tree):
        found.append(OPEN_CYCLE)
    return tuple(found)


def peak_warnings(run: CycleRun) -> tuple[str, ...]:
    """What to say of a torque beyond its peak limit, if there is one."""
    if run.peak_torque_ratio <= 1.0:
        return ()
    worst = max(run.moves, key=lambda move: move.peak_torque_ratio)
    return (torque_warning(worst.peak_torque_ratio, f" in move '{worst.name}'"),)


def _cycle_run(batch: TreeBatch, runs: MotionRuns, rows: slice, k: int, tree: OperationTree) -> CycleRun:
    """One tree, whose motions are some rows of column `k` of the runs."""
    vertices, moves = graph_of_tree(tree).vertices, {move.name: move for move in tree.moves()}
    idle_prior_w, idle_post_w = batch.idle_prior_w[rows], batch.idle_post_w[rows]
    prior = np.array([v.least_prior_wait_s + moves[v.moves[0]].added_wait_before_s for v in vertices])
    post = np.array([v.least_post_wait_s + moves[v.moves[-1]].added_wait_after_s for v in vertices])
    durations, peak_powers = runs.duration_s[rows, k], runs.peak_power_w[rows, k]
    standing_j, saved_j = standing_energies_j(batch.robot, tree, prior, post, idle_prior_w, idle_post_w)
    vertex_energies = runs.energy_j[rows, k] + standing_j
    cycle_time_s = float((prior + durations + post).sum())
    before, after = (torque[rows] ** 2 for torque in batch.executed.standing_torque_nm)  # which motors hold in waits
    squared = runs.torque_square_integral_nm2_s[rows, k].sum(axis=0) + prior @ before + post @ after
    processes = _process_powers_w(tree, idle_prior_w, idle_post_w)
    return CycleRun(
        names=tuple(vertex.name for vertex in vertices),
        through=tuple(vertex.moves[:-1] for vertex in vertices),
        speed_limits=runs.speed_limit[rows, k],
        durations_s=durations,
        prior_waits_s=prior,
        post_waits_s=post,
        vertex_energies_j=vertex_energies,
        peak_powers_w=peak_powers,
        peak_torque_ratios=runs.peak_torque_ratio[rows, k],
        rms_torque_ratio=rms_torque_ratio(batch.robot, squared, cycle_time_s),
        energy_j=float(vertex_energies.sum()) + process_energy_j(tree),
        cycle_time_s=cycle_time_s,
        peak_power_w=float(max([*peak_powers, *idle_prior_w[prior > 0.0], *idle_post_w[post > 0.0], *processes])),
        standby_saving_j=saved_j,
        standby=batch.robot.standby,
        end_standing_s=float(post[-1] + (prior[0] if closes(tree) else 0.0)),
    )


def standing_energies_j(
    robot: Robot, tree: OperationTree, prior_s: Array, post_s: Array, idle_prior_w: Array, idle_post_w: Array
) -> tuple[Array, float]:
    """Energy of the waits of each of V motions, shape (V,), and what standby modes save on all of them. [J]"""
    holding = np.stack([idle_prior_w * prior_s, idle_post_w * post_s], axis=1)
    if not robot.standby:
        return holding.sum(axis=1), 0.0
    closed = closes(tree)
    time, held_j = (standing(waits, closed) for waits in (np.stack([prior_s, post_s], axis=1), holding))
    power = np.append(idle_prior_w, idle_post_w[-1])[: len(time)]
    share = np.divide(standing_energy_j(robot.standby, power, time), held_j, out=np.ones_like(time), where=held_j > 0.0)
    after = np.append(share[1:], share[0] if closed else 1.0)[: len(prior_s)]
    used = holding * np.stack([share[: len(prior_s)], after], axis=1)
    return used.sum(axis=1), float(holding.sum() - used.sum())


def rms_torque_ratio(robot: Robot, square_integral_nm2_s: Array, duration_s: float) -> float:
    """Largest root mean square of a joint torque, of integrals (n,) over a time [s], over its continuous limit. [-]"""
    if duration_s <= 0.0:
        return 0.0
    return float((np.sqrt(square_integral_nm2_s / duration_s) / robot.effort_nm).max())


def _process_powers_w(tree: OperationTree, idle_prior_w: Array, idle_post_w: Array) -> list[float]:
    """Mains power during each process step: its own and that of the standing robot. [W]"""
    powers, standing_w = [], float(idle_prior_w[0])
    moved = 0
    for operation in tree.atomic():
        if isinstance(operation, MoveOperation):
            standing_w = float(idle_post_w[moved])
            moved += operation.is_fine
        elif isinstance(operation, ProcessOperation) and operation.duration_s > 0.0:
            powers.append(standing_w + operation.power_w)
    return powers
