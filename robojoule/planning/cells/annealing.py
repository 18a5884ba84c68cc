"""Annealing over tours, poses, phases and waits of all robots: the start for cells that are too large for the model.

State: a tour and a pose of each static activity, the start of each robot's cycle, the pace of each movement, and how
the spare time of a cycle is shared among the stays. At a robot's price of time, movements last as long as is best at
that price, so a tour costs a sum over its movements and its best poses come from a dynamic program. That price is as
high as the cycle allows, up to where it is better to wait; a pace sets it higher or lower for one movement. Time lags,
poses of hand-overs and collisions are penalised, gently at first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread
from typing import NamedTuple

import numpy as np

from robojoule.arrays import Array, Index, Mask
from robojoule.planning.cells.annealing_kernel import HOT_J, anneal

_WHOLE = (
    *("robot", "last", "first", "location", "stay", "table", "table_origin", "arcs", "arc_origin", "move_dynamic"),
    *("tail", "lags", "lag_row", "lag_list", "hands", "fits", "fit_origin", "hand_row", "hand_list"),
    *("meetings", "meet_row", "meet_list"),
)
_FLOATING = (
    *("cycle_time_s", "price_w", "move_cost_j", "move_time_s", "place_cost_j"),
    *("stay_power_w", "stay_least_s", "stay_longest_s", "lag_length_s", "highest_level"),
)


_WATCH_S = 0.1


class Problem(NamedTuple):
    """What does not change: R robots, V static activities, L locations, S stays, T movements.

    Lags hold, for both ends, the static activity and AT_START, AT_END, or the dynamic activity that must leave it.
    Meetings hold activity and choice of both sides. `*_row` and `*_list` list for each robot what it takes part in.
    """

    cycle_time_s: float
    robot: Index  # (V,)
    last: Mask  # (V,) whether it ends the cycle
    first: Index  # (R + 1,) static activities of each robot, which are numbered in a row
    location: Index  # (V + 1,) first location of each static activity
    stay: Index  # (L + 1,) first stay of each location
    price_w: Array  # (R,)
    table: Index  # movement between two locations of a robot, -1: none
    table_origin: Index  # (R,)
    arcs: Mask  # whether a dynamic activity joins two static ones of a robot
    arc_origin: Index  # (R,)
    move_cost_j: Array  # (T, LEVELS) energy less price of the time, at the durations that are best at rising prices
    move_time_s: Array  # (T, LEVELS)
    move_dynamic: Index  # (T,)
    tail: Index  # (E,) static activity before each dynamic one
    place_cost_j: Array  # (L,) the same of the shortest stay
    stay_power_w: Array  # (S,) by rising least duration
    stay_least_s: Array
    stay_longest_s: Array
    lags: Index  # (G, 4)
    lag_length_s: Array  # (G,) with the cycles taken off
    highest_level: Array  # (R,) from which on it is better to wait, from the middle one
    lag_row: Index
    lag_list: Index
    hands: Index  # (H, 2)
    fits: Mask
    fit_origin: Index  # (H,)
    hand_row: Index
    hand_list: Index
    meetings: Index  # (C, 4)
    meet_row: Index
    meet_list: Index


class State(NamedTuple):
    """What changes, and what follows from it."""

    order: Index  # (V,) static activities, robot after robot, each tour ending with the last of the cycle
    pose: Index  # (V,) location of each static activity
    share: Array  # (V,) of the spare time of its robot
    phase_s: Array  # (R,)
    leaving: Index  # (V,) movement that leaves each static activity
    begin_s: Array  # (V,) start since the start of the cycle
    stay_s: Array  # (V,)
    move_s: Array  # (V,) of what leaves it
    pace: Array  # (V,) levels by which the price of time of what leaves it is above that of its robot


def run(
    problem: Problem,
    state: State,
    iterations: int,
    seed: int,
    hot_j: float = HOT_J,
    stop: Callable[[], bool] | None = None,
) -> float:
    """Anneal a state in place to the best one that was met in the last part of the run; returns its cost. [J]

    Where the run does not begin as hot as from a state at random, penalties are as they are at the end. `stop` is asked
    now and then, from another thread, whether the run shall end with what it has.
    """
    o, whole, floating = _packed(problem)
    C = np.stack([state.order, state.pose, state.leaving]).astype(np.int64)
    timed = (state.share, state.begin_s, state.stay_s, state.move_s, state.pace)
    X = np.stack(timed)
    halt = np.zeros(1, dtype=np.int64)
    with _watched(stop, halt):
        cost = float(anneal(o, whole, floating, C, X, state.phase_s, iterations, seed, hot_j, halt))
    for field, values in zip((state.order, state.pose, state.leaving), C, strict=True):
        field[:] = values
    for times, found in zip(timed, X, strict=True):
        times[:] = found
    return cost


def compile_kernel() -> None:
    """Compile what `run` needs, or load it where it was compiled before; takes seconds, other threads go on."""
    whole, rows, floating = np.zeros(40, dtype=np.int64), np.zeros((3, 1), dtype=np.int64), np.zeros((5, 1))
    anneal(whole, whole, np.zeros(40), rows, floating, np.zeros(0), 0, 0, HOT_J, np.zeros(1, dtype=np.int64))


@contextmanager
def _watched(stop: Callable[[], bool] | None, halt: Index) -> Iterator[None]:
    """Set `halt` as soon as a stop is asked for."""
    if stop is None:
        yield
        return
    over = Event()

    def watch() -> None:
        while not over.wait(_WATCH_S):
            if stop():
                halt[0] = 1
                return

    watching = Thread(target=watch, daemon=True)
    watching.start()
    try:
        yield
    finally:
        over.set()
        watching.join()


def _packed(p: Problem) -> tuple[Index, Array, Array]:
    """Beginnings, whole numbers and floating numbers of a problem."""
    begins: list[int] = []
    arrays: list[Array] = []
    for names, kind in ((_WHOLE, np.int64), (_FLOATING, np.float64)):
        parts = [np.atleast_1d(np.asarray(getattr(p, name), dtype=kind)).ravel() for name in names]
        begins += [0, *np.cumsum([part.size for part in parts])[:-1].tolist()]
        arrays.append(np.concatenate(parts))
    counts = [p.price_w.size, p.robot.size, p.place_cost_j.size, len(p.lags), len(p.hands), len(p.meetings)]
    return np.array([*begins, *counts], dtype=np.int64), arrays[0], arrays[1]
