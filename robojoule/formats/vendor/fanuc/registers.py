"""Numbers of teach pendant programs: literals, and registers as far as constants reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from lark import Token


@dataclass
class Registers:
    """Registers R[n] whose value is known.

    Attributes:
        values: Their values by their numbers.
    """

    values: dict[int, float] = field(default_factory=dict)

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
    return int(inside) if inside.isdigit() else None
