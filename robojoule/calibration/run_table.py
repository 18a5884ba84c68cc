"""Measured runs of a program's moves, as a user writes them down: move, speed limit, duration and, if known, energy.

Columns: `move` (its name in the program, or its number from 1), `speed_limit_percent`, `duration_s` and optionally
`energy_j`, whose cells may be empty. Rows stand in the order of execution where the same stamps end one move and begin
the next one: rounding of stamps then cancels in the sum of a cycle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from robojoule.arrays import Array, Index, freeze, frozen
from robojoule.calibration.log_table import LogTable, read_table
from robojoule.errors import InputError
from robojoule.inputs import LONGEST_S, as_number, as_path, unknown_name

LEAST_LIMIT = 1e-3  # a tenth of a percent
MOST_ENERGY_J = 1e9
# Steps in which durations are given: of stop watches, of controllers' cycles.
_RESOLUTIONS_S = (1.0, 0.5, 0.1, 0.05, 0.02, 0.012, 0.01, 0.008, 0.005, 0.004, 0.002, 0.001)
# Steps in which meters of energy are read; a reading in finer ones is as good as exact.
_ENERGY_STEPS_J = (36000.0, 10000.0, 3600.0, 1000.0, 500.0, 360.0, 100.0, 50.0, 36.0, 20.0, 10.0, 5.0, 2.0, 1.0)
_FEWEST_TO_JUDGE = 3
_FINEST_S = 5e-4


@dataclass(frozen=True, eq=False)
class MeasuredRuns:
    """Runs of the moves of a program, R of them; immutable.

    Attributes:
        source: Where they come from, for messages.
        motion: Which move of the program each is, from 0, shape (R,).
        speed_limits: Fractions in (0, 1], shape (R,). [-]
        duration_s: Shape (R,). [s]
        energy_j: Electrical energy of the movement, NaN where it was not measured, shape (R,). [J]
        resolution_s: Step in which instants were taken down. [s]
    """

    source: str
    motion: Index
    speed_limits: Array
    duration_s: Array
    energy_j: Array
    resolution_s: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "motion", np.array(self.motion))
        for name in ("speed_limits", "duration_s", "energy_j"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        freeze(self)  # the motions, too

    def __repr__(self) -> str:
        return (
            f"MeasuredRuns({self.source!r}: {self.motion.size} runs of {np.unique(self.motion).size} moves, "
            f"resolution_s={self.resolution_s:g})"
        )

    def joined(self, other: MeasuredRuns) -> MeasuredRuns:
        """These runs and later ones."""
        return MeasuredRuns(
            source=self.source,
            motion=np.concatenate([self.motion, other.motion]),
            speed_limits=np.concatenate([self.speed_limits, other.speed_limits]),
            duration_s=np.concatenate([self.duration_s, other.duration_s]),
            energy_j=np.concatenate([self.energy_j, other.energy_j]),
            resolution_s=max(self.resolution_s, other.resolution_s),
        )


def is_run_table(path: str | Path) -> bool:
    """Whether a file is meant as a table of runs, not as a log: it has a column of moves or durations, none of time."""
    names = read_table(as_path(path, "runs")).names
    return ("move" in names or "duration_s" in names) and "time_s" not in names


def read_runs(path: str | Path, moves: Sequence[str]) -> MeasuredRuns:
    """Read and check a table of runs.

    Args:
        path: CSV or Parquet file.
        moves: Names of the program's moves in order.

    Raises:
        InputError: The file cannot be read, a column is missing or not of numbers, a move is unknown, or a value is out
            of range.
    """
    table = read_table(as_path(path, "runs"))
    source = table.source
    motion = np.array([_move(word, moves, table) for word in table.words("move")], dtype=np.intp)
    limits = table.column("speed_limit_percent") / 100.0
    duration = table.column("duration_s")
    energy = np.full(duration.shape, np.nan)
    if "energy_j" in table.names:
        energy = table.values(table.names.index("energy_j"))
    runs = MeasuredRuns(source, motion, limits, duration, energy, resolution_of(duration))
    check_range(runs, len(moves))
    return runs


def check_range(runs: MeasuredRuns, moves: int) -> None:
    """Refuse runs of arrays that do not fit together, of moves that there are not, or with values out of range.

    Args:
        runs: The runs.
        moves: Number of the program's moves.

    Raises:
        InputError: They are; names the row.
    """
    source, limits, duration, energy = runs.source, runs.speed_limits, runs.duration_s, runs.energy_j
    motion = np.asarray(runs.motion)
    if motion.ndim != 1 or motion.size == 0 or any(one.shape != motion.shape for one in (limits, duration, energy)):
        problem = "the arrays of runs are not of one length, or empty"
        raise InputError(problem, file=source, allowed="as many motions as speed limits, durations and energies")
    if motion.dtype.kind not in "iu" or not ((motion >= 0) & (motion < moves)).all():
        raise InputError("a run is of no move of the program", file=source, key="motion", allowed=f"0 to {moves - 1}")
    for values, key, least, most, allowed in (
        (limits, "speed_limit_percent", LEAST_LIMIT, 1.0, "0.1 to 100 %"),
        (duration, "duration_s", 1e-3, LONGEST_S, f"0.001 to {LONGEST_S:g} s"),
        (energy, "energy_j", -MOST_ENERGY_J, MOST_ENERGY_J, f"-{MOST_ENERGY_J:g} to {MOST_ENERGY_J:g} J"),
    ):
        bad = np.flatnonzero(~((values >= least) & (values <= most)) & ~(np.isnan(values) & (key == "energy_j")))
        if bad.size:
            raise InputError(f"row {bad[0] + 1} is out of range", file=source, key=key, allowed=allowed)
    as_number(runs.resolution_s, "resolution_s", least=0.0, most=LONGEST_S, unit="s")


def _move(word: str, moves: Sequence[str], table: LogTable) -> int:
    if word in moves:
        return list(moves).index(word)
    if word.isascii() and word.isdigit() and 1 <= int(word) <= len(moves):
        return int(word) - 1
    error = unknown_name("move", word, moves, f"a move of the program, or its number from 1 to {len(moves)}")
    raise InputError(error.problem, file=table.source, key="move", allowed=error.allowed)


def resolution_of(durations_s: Array) -> float:
    """Step in which durations were taken down: the largest usual one of which all are multiples. [s]"""
    return _step_of(durations_s, _RESOLUTIONS_S) or _FINEST_S


def energy_step_of(energies_j: Array) -> float:
    """Step in which energies were read; 0 where it is below a joule, or too few (not NaN) are there to say. [J]"""
    return _step_of(energies_j[np.isfinite(energies_j)], _ENERGY_STEPS_J)


def _step_of(values: Array, steps: tuple[float, ...]) -> float:
    """The largest of some falling steps of which all values are multiples; 0 if none is, or values are too few."""
    if values.size < _FEWEST_TO_JUDGE:
        return 0.0
    for step in steps:
        shares = np.abs(values) / step
        if np.all(np.abs(shares - np.round(shares)) < 1e-6 * np.maximum(shares, 1.0)):
            return step
    return 0.0
