"""One robot over a cycle of its cell, from the simulation of its program as it stands."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robojoule.arrays import Array, Index
from robojoule.errors import InputError
from robojoule.formats.program import Program
from robojoule.formats.robot_cell import PlacedRobot
from robojoule.motion.time_laws import PathLaw
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun, simulate_trees
from robojoule.planning.tree_motions import closes
from robojoule.programs.operation_tree import MoveOperation, ProcessOperation
from robojoule.programs.tree_check import in_model_angles
from robojoule.robots.clearance import Courses, PlacedArm, TimedCourses
from robojoule.robots.drives import mains_power_w
from robojoule.robots.standby import standing_energy_j

_SHORTEST_S = 1e-12


@dataclass(frozen=True)
class Piece:
    """Standing or moving for some time.

    Attributes:
        move: Number of the move; of standing, that of the move before it.
        moves: Whether the robot moves.
        begin_s: Start since the start of the program. [s]
        end_s: End. [s]
    """

    move: int
    moves: bool
    begin_s: float
    end_s: float


class Timeline:
    """A robot in its cell.

    Args:
        placed: The robot.
        program: What it does; written for it, plan and all.
        start_s: When its program starts in the cell. [s]
        cycle_time_s: Cycle time of the cell. [s]

    Attributes:
        run: Simulation of the program by itself.
        pieces: What it does since the start of its program: standing before the first move, then move by move, each
            with the standing after it.
        times_s: When each operation of the program starts and ends, since its start. [s]

    Raises:
        InputError: The program does not fit the robot, or does not close.
    """

    def __init__(self, placed: PlacedRobot, program: Program, start_s: float, cycle_time_s: float) -> None:
        self.placed, self.start_s, self.cycle_time_s = placed, start_s, cycle_time_s
        program.check(placed.robot)
        self.tree = in_model_angles(program.tree, placed.robot)
        if not closes(self.tree):
            problem = "the program ends elsewhere than it starts"
            raise InputError(problem, file=program.path, key=f"robot {placed.name}")
        self._batch = TreeBatch(placed.robot, [self.tree])
        self.run: CycleRun = simulate_trees(self._batch, [[self.tree]])[0][0]
        self.pieces = self._pieces()
        self.times_s, self._process_w = self._operations()

    def _pieces(self) -> tuple[Piece, ...]:
        run, pieces, time = self.run, [], 0.0
        for i in range(len(run.names)):
            before = run.prior_waits_s[i] + (run.post_waits_s[i - 1] if i else 0.0)
            pieces.append(Piece(i - 1, False, time, time := time + float(before)))
            pieces.append(Piece(i, True, time, time := time + float(run.durations_s[i])))
        pieces.append(Piece(len(run.names) - 1, False, time, time + float(run.post_waits_s[-1])))
        return tuple(pieces)

    def _operations(self) -> tuple[dict[str, tuple[float, float]], list[tuple[float, float, float]]]:
        times: dict[str, tuple[float, float]] = {}
        powers: list[tuple[float, float, float]] = []
        time, moved = 0.0, 0
        for step in self.tree.atomic():
            if isinstance(step, MoveOperation):
                piece = self.pieces[2 * moved + 1]
                times[step.name] = (piece.begin_s, piece.end_s)
                time, moved = piece.end_s + step.all_after_s, moved + 1
                continue
            times[step.name] = (time, time := time + step.duration_s)
            if isinstance(step, ProcessOperation) and step.power_w > 0.0:
                powers.append((*times[step.name], step.power_w))
        return times, powers

    @cached_property
    def standing(self) -> tuple[tuple[float, str], ...]:
        """Power of standing after each move, in the mode that costs least [W], and the name of that mode."""
        run, found = self.run, []
        for i in range(len(run.names)):
            following = run.prior_waits_s[(i + 1) % len(run.names)]
            time = float(run.post_waits_s[i] + following)
            holding = float(self._batch.idle_post_w[i])
            power, mode = holding, "motors on"
            for one in self.placed.robot.standby:
                if standing_energy_j([one], power, time) < power * time:
                    power, mode = one.power_w, one.name
            found.append((power, mode))
        return tuple(found)

    @property
    def holding_w(self) -> float:
        """Power of motors that hold the robot where its program ends. [W]"""
        return float(self._batch.idle_post_w[-1])

    @cached_property
    def energies_j(self) -> tuple[tuple[float, float], ...]:
        """Energy of each move, and of standing after it with its process steps. [J]"""
        run = self.run
        moved = self._batch.paths.simulate(run.speed_limits[:, None]).energy_j[:, 0]
        following = np.roll(run.prior_waits_s, -1)
        times = run.post_waits_s + following
        stood = [power * time for (power, _), time in zip(self.standing, times.tolist(), strict=True)]
        for begin, end, power in self._process_w:
            moved_before = sum(piece.moves and piece.end_s <= begin for piece in self.pieces)
            stood[moved_before - 1] += power * (end - begin)  # what comes before the first move: after the last one
        return tuple(zip(moved.tolist(), stood, strict=True))

    @cached_property
    def _laws(self) -> tuple[PathLaw, ...]:
        velocity = self._batch.paths.peak_velocities(self.run.speed_limits[:, None])[:, 0]
        return tuple(self._batch.paths.law(i, float(v)) for i, v in enumerate(velocity))

    @cached_property
    def _parts(self) -> list[tuple[Piece, float, float]]:
        """Pieces within the cycle of the cell, in their order, with the times of their start [s] and of their end."""
        cycle, parts = self.cycle_time_s, []
        for piece in self.pieces:
            length = piece.end_s - piece.begin_s
            begin = (self.start_s + piece.begin_s) % cycle
            over = begin + length - cycle
            if over > _SHORTEST_S:
                parts += [(piece, begin, cycle), (piece, begin - cycle, over)]
            elif length > _SHORTEST_S:
                parts.append((piece, begin, begin + length))
        return sorted(parts, key=lambda part: part[2])

    def courses(self, arm: PlacedArm) -> TimedCourses:
        """What the arm does over a cycle of the cell."""
        points = self.tree.configurations_rad()
        start = [points[part[0].move] if part[0].moves else points[part[0].move + 1] for part in self._parts]
        end = [points[part[0].move + 1] for part in self._parts]
        ends = np.array([part[2] for part in self._parts])
        ends[-1] = self.cycle_time_s
        return TimedCourses(arm, Courses(np.array(start), np.array(end) - np.array(start)), ends, self._places)

    def _places(self, pieces: Index, time_s: Array) -> Array:
        place: Array = self._states(pieces, time_s)[0]
        return place

    def _states(self, pieces: Index, time_s: Array) -> Array:
        """Path position, velocity and acceleration of parts of the cycle at times of the cell, shape (3, N)."""
        found = np.zeros((3, len(time_s)))
        for number in np.unique(pieces):
            piece, begin, _ = self._parts[number]
            if piece.moves:
                here, law = pieces == number, self._laws[piece.move]
                # A learnt controller may take less than its law by a little: the law is then gone through faster.
                hurry = max(law.total_s / (piece.end_s - piece.begin_s), 1.0)
                found[:, here] = law.at(np.clip(hurry * (time_s[here] - begin), 0.0, law.total_s))[:3]
        return found

    def power_w(self, time_s: Array) -> Array:
        """Mains power at times of the cell, shape (N,). [W]"""
        ends = np.array([part[2] for part in self._parts])
        pieces = np.searchsorted(ends, time_s, side="right").clip(max=len(ends) - 1)
        states = self._states(pieces, time_s)
        power = np.zeros(len(time_s))
        for number in np.unique(pieces):
            piece = self._parts[number][0]
            here = pieces == number
            if piece.moves:
                state = states[:, here]
                bus = self._batch.paths.powers(np.array([piece.move]), *(one[None] for one in state)).bus_w
                power[here] = mains_power_w(self.placed.robot.drives, bus)[0]
            else:
                power[here] = self.standing[piece.move][0]
        local = (time_s - self.start_s) % self.cycle_time_s
        for begin, end, own in self._process_w:
            power[(local >= begin) & (local < end)] += own
        return power

    def instants(self) -> list[float]:
        """When in the cycle of the cell the power may jump or bend: parts, their phases and process steps end. [s]"""
        found = [(self.start_s + time) % self.cycle_time_s for one in self._process_w for time in one[:2]]
        for piece, begin, end in self._parts:
            found += [begin, end]
            if piece.moves:
                found += (begin + np.cumsum(self._laws[piece.move].duration_s)).tolist()
        return found

    def peaks(self) -> list[tuple[float, float, float]]:
        """Parts of the cycle of the cell, their start and end [s] with the largest power in them [W]."""
        found = []
        for piece, begin, end in self._parts:
            if piece.moves:
                power = float(self.run.peak_powers_w[piece.move])
            else:
                local = piece.begin_s, piece.end_s
                own = [p for low, high, p in self._process_w if low < local[1] and high > local[0]]
                power = self.standing[piece.move][0] + max(own, default=0.0)
            found.append((max(begin, 0.0), end, power))
        return found
