"""Numbers of teach pendant programs: literals, and registers as far as constants reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from lark import Token


@dataclass
class Registers:
    """What a program and those that it calls share: registers whose value is known, and what they have overwritten.

    Attributes:
        values: Values of registers R[n] by their numbers.
        overwritten: Names of position registers and frames, as in "PR[1]", to which the program has given other figures
            than those that are given beside it; without a number, all of them.
    """

    values: dict[int, float] = field(default_factory=dict)
    overwritten: set[str] = field(default_factory=set)

    def forget(self, number: int | None) -> None:
        """A register is not known any more; None: that may be any of them."""
        if number is None:
            self.values.clear()
        else:
            self.values.pop(number, None)

    def overwrite(self, kind: str, number: int | None) -> None:
        """A position register or frame has other figures from here on; None: that may be any of them."""
        self.overwritten.add(kind if number is None else f"{kind}[{number}]")

    def is_overwritten(self, kind: str, number: int) -> bool:
        """Whether a position register or frame may have other figures than those that are given."""
        return not self.overwritten.isdisjoint((kind, f"{kind}[{number}]"))

    def whole(self, text: str) -> int | None:
        """A whole number, or the value of a register where that is one."""
        if text[:1].upper() == "R" and "[" in text:
            value = self.amount(text)
            return int(value) if value is not None and value.is_integer() else None
        return _digits(text)

    def amount(self, text: str) -> float | None:
        """A number, or the value of a register where that is known."""
        if text[:1].upper() == "R" and "[" in text:
            number = index_of(text)
            return self.values.get(number) if number is not None else None
        try:
            return float(text)
        except ValueError:
            return None

    def total(self, tokens: Sequence[Token]) -> float | None:
        """A sum of numbers and registers; None: it is not known, or something else."""
        texts = [str(token) for token in tokens if str(token) not in ("(", ")")]
        total, sign = 0.0, 1.0
        expects_amount = True
        for text in texts:
            if expects_amount and text == "-":
                sign = -sign
                continue
            if expects_amount:
                amount = self.amount(text)
                if amount is None:
                    return None
                total += sign * amount
            elif text not in ("+", "-"):
                return None
            else:
                sign = 1.0 if text == "+" else -1.0
            expects_amount = not expects_amount
        return None if expects_amount or any(str(token) == "(" for token in tokens[1:]) else total


def index_of(register: str) -> int | None:
    """The number of a register such as R[3:count]; None: it is in another register."""
    if "[" not in register:
        return None
    inside = register[register.index("[") + 1 : -1].split(":")[0].strip()
    return _digits(inside)


def _digits(text: str) -> int | None:
    return int(text) if text.isascii() and text.isdecimal() else None
