"""Loops without end: which of their passes is the cycle.

What a pass sets, such as a speed, the payload or a counter, holds for the next one. So further passes are run until
nothing changes any more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace

import numpy as np

from robojoule.formats.vendor.running import MOST_STEPS, Running
from robojoule.formats.vendor.trace import Event, Load, Motion, Speed
from robojoule.robots.robot import Payload

_MOST_PASSES = 12  # that are run to see whether they are all the same
_MOST_PASSES_TO_AN_END = 100  # where lines of the loop may leave it


def keep_cycle(
    running: Running,
    since: int,
    line: int,
    next_pass: Callable[[], bool],
    state: Callable[[], object],
    *,
    may_end: bool = False,
) -> int | None:
    """Run a loop without end, whose first pass has run, again, and keep of its passes the one that is the cycle.

    Args:
        running: What has run; its events behind `since` are those of the first pass.
        since: How many events there were before the loop.
        line: Line of the loop, for notes.
        next_pass: Runs the loop's body once more; false: that has left the loop.
        state: What the program knows of its variables and settings.
        may_end: Whether lines of the loop leave it on grounds that are known.

    Returns:
        How many events there are before those of the cycle; None: the loop is left, the events of all passes stay.
    """
    events = running.events
    ends, passes = [since, len(events)], [_deeds(events, since)]
    most = _MOST_PASSES_TO_AN_END if may_end else _MOST_PASSES
    is_settled = False
    while not is_settled and len(passes) < most and running.steps < MOST_STEPS // 2:
        before = _plain(state())
        if not next_pass():
            return None
        passes.append(_deeds(events, ends[-1]))
        ends.append(len(events))
        is_settled = passes[-1] == passes[-2] and _plain(state()) == before
    if may_end and not is_settled:
        running.note(line, f"the loop is not left within {len(passes)} passes: one of them is the cycle")
    chosen = 1 if len(passes) > 2 and passes[1] != passes[0] and passes[2] == passes[1] else 0
    others = [one for one in passes[chosen:] if one != passes[chosen]]
    if others:
        differing = passes.index(others[0]) + 1
        text = f"passes of the loop are not all the same (pass {differing} differs): pass {chosen + 1} is planned"
        running.note(line, text)
    elif chosen:
        running.note(line, "the first pass of the loop differs from all further ones: these are planned")
    loads = [event for event in events[since : ends[chosen]] if isinstance(event, Load)]
    changing = _changing(events)  # those before the loop, too
    changing |= _on_other_ways(events, ends, chosen)
    kept = events[ends[chosen] : ends[chosen + 1]]
    cycle = [_unchanged(one) if _statement(one) in changing else one for one in kept]
    events[since:] = [*loads, *cycle]
    return since + len(loads)


def _deeds(events: Sequence[Event], since: int) -> list[object]:
    """What happens from an event on, with the payload that is carried meanwhile, to compare passes."""
    carried: Payload | None = None
    found: list[object] = []
    for index, event in enumerate(events):
        if isinstance(event, Load):
            carried = event.payload or carried
        elif index >= since:
            found.append((_plain(event), carried))
    return found


def _plain(value: object) -> object:
    """A value in parts that are compared by what they are, arrays too."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(one) for one in value]
    if is_dataclass(value) and not isinstance(value, (type, Payload)):
        return type(value), [_plain(getattr(value, one.name)) for one in fields(value)]
    return value


def _changing(events: Sequence[Event]) -> set[int]:
    """Motions that have run at several speeds."""
    speeds: dict[int, set[Speed]] = {}
    for event in events:
        if isinstance(event, Motion):
            speeds.setdefault(event.statement, set()).add(replace(event.speed, writable=True))
    return {statement for statement, found in speeds.items() if len(found) > 1}


def _on_other_ways(events: Sequence[Event], ends: Sequence[int], chosen: int) -> set[int]:
    """Motions that come from elsewhere in a later pass: there a duration, or a speed in m/s, means another one."""
    ways: list[set[tuple[int, str]]] = []
    motions = [event for event in events[ends[chosen] : ends[chosen + 1]] if isinstance(event, Motion)]
    before = motions[-1] if motions else None
    for start, end in zip(ends[chosen:], ends[chosen + 1 :], strict=False):
        found = set()
        for event in events[start:end]:
            if isinstance(event, Motion):
                speed = event.speed
                is_share = {speed.duration_s, speed.leading_rad_s, speed.tool_m_s} == {None}
                if not is_share and before is not None:
                    found.add((event.statement, repr(_plain(before.target))))
                before = event
        ways.append(found)
    return {statement for found in ways[1:] for statement, _ in found - ways[0]}


def _statement(event: Event) -> int | None:
    return event.statement if isinstance(event, Motion) else None


def _unchanged(event: Event) -> Event:
    assert isinstance(event, Motion)
    return replace(event, speed=replace(event.speed, writable=False))
