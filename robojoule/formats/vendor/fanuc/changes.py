"""What instructions set, for where nobody knows whether they run, or what value they give."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import dropwhile

from lark import Token

from robojoule.formats.vendor.fanuc.syntax import Block, Instruction, within

# The instructions of another program, by its name; None: it is not there.
Find = Callable[[str], Sequence[Instruction | Block] | None]
DEEPEST_CALLS = 20  # of programs beside each other


def changed_by(body: Sequence[Instruction | Block], find: Find, names: frozenset[str] = frozenset()) -> Iterator[str]:
    """What instructions, and the programs beside that they call, may set: R[1], P[2], UTOOL_NUM, PAYLOAD[1] ...

    Args:
        body: The instructions.
        find: Finds a program beside this one.
        names: Programs that are being looked through, in capitals; their positions P[n] are their own.
    """
    for one in within(body):
        if one.tree is None:
            continue
        action = action_of(one) if one.kind == "branch" else []
        tokens = action or list(one.tree.scan_values(lambda value: isinstance(value, Token)))
        if one.kind in ("assignment", "for_") or assigns(action) or is_payload(tokens):
            if not (names and tokens[0].startswith("P[")):
                yield str(tokens[0])
            continue
        called = called_by(one, tokens)
        if called and called not in names and len(names) < DEEPEST_CALLS:
            yield from changed_by(find(called) or [], find, names | {called})


def action_of(branch: Instruction) -> list[Token]:
    """What a branch on a condition does if it holds: what stands behind the first comma outside of parentheses.

    Where there is no such comma, it is what jumps or calls.
    """
    assert branch.tree is not None
    tokens = list(branch.tree.scan_values(lambda value: isinstance(value, Token)))
    depth = 0
    for at, token in enumerate(tokens):
        depth += {"(": 1, ")": -1}.get(str(token), 0)
        if token == "," and depth == 0:
            return tokens[at + 1 :]
    return list(dropwhile(lambda token: token.type not in ("JUMP", "CALL"), tokens))


def assigns(action: Sequence[Token]) -> bool:
    """Whether the action of a branch is an assignment."""
    return len(action) > 1 and action[0].type in ("REGISTER", "WORD", "POINT") and action[1].type == "EQUALS"


def is_payload(tokens: Sequence[Token]) -> bool:
    """Whether an instruction says what the robot carries."""
    return bool(tokens) and tokens[0].upper().startswith("PAYLOAD[")


def called_by(one: Instruction, tokens: Sequence[Token]) -> str:
    """The program that an instruction calls, in capitals; empty: none."""
    if one.kind == "call":
        return str(tokens[0]).upper()
    following = [tokens[at + 1] for at, token in enumerate(tokens[:-1]) if token.type == "CALL"]
    return str(following[0]).upper() if following else ""
