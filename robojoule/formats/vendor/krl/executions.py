"""What a machine keeps of the motions that have run: how their speeds are set, and blocks of splines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from robojoule.formats.vendor.krl.syntax import Block
from robojoule.formats.vendor.lines import Line
from robojoule.formats.vendor.text import Span
from robojoule.formats.vendor.values import Number, Value
from robojoule.robots.robot import Payload


@dataclass
class Setting:
    """How the speed of one motion statement is set.

    Attributes:
        line: Its line.
        percent: The speed that counted; None: it is not known. [%]
        data: Where the velocity of its motion data stands, if it has any.
    """

    line: Line
    percent: float | None
    data: set[Number] = field(default_factory=set)


@dataclass(frozen=True)
class Executed:
    """One execution of a joint motion.

    Attributes:
        statement: First character of its statement.
        set_by: Which setting of the speed of axes was in force; a number of its own where the motion says it itself.
        origin: Where that speed stands as a number; None: nowhere.
        percent: That speed; None: it is not known. [%]
        others: Where the speeds of its axes stand, if not all of them in one place.
        is_partly_set: Whether some axes have theirs from before another motion: a speed set before that one stays.
    """

    statement: int
    set_by: int
    origin: Span | None
    percent: float | None
    others: frozenset[Span] = frozenset()
    is_partly_set: bool = False


@dataclass(frozen=True)
class Mark:
    """How far a program has been run: how many events and executions there are, and what was known then."""

    events: int
    executions: int
    carried: Payload | None
    settings: dict[int, Setting]


@dataclass(frozen=True)
class Spline:
    """A block of motions without a stop between them, as it runs.

    Attributes:
        block: The block.
        last: First character of its last motion.
        told: What its head sets for all of its motions.
    """

    block: Block
    last: int
    told: Mapping[str, Value]
