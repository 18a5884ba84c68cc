"""Claims of the thesis beside what comes out here: how one is said, written and read; how tables say true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from reproduction.tables import Row, read_csv, write_csv
from robojoule.errors import InputError


@dataclass(frozen=True)
class Claim:
    """A statement of the thesis, held against the results.

    Attributes:
        claim: The statement.
        thesis: What the thesis found.
        robojoule: What comes out here.
        held: Whether the result is as good or points the same way; none if it cannot be told.
    """

    claim: str
    thesis: str
    robojoule: str
    held: bool | None

    def row(self) -> Row:
        """Cells of the claim in a result table."""
        return {"claim": self.claim, "thesis": self.thesis, "robojoule": self.robojoule, "held": verdict(self.held)}


BY_ROUNDING = "held as printed"
"""Remark on a claim that holds only because both figures are rounded to the digits that the thesis printed."""


def held_as_printed(found: float, published: float, *, least: bool = False) -> tuple[bool, str]:
    """Whether a figure reaches a published one, both with the digits that were printed.

    Args:
        found: What comes out here.
        published: What the thesis printed; trailing zeros do not count.
        least: Whether the published figure is the least one that will do, instead of the largest.

    Returns:
        The verdict, and a remark where rounding alone makes it true, else nothing.
    """
    digits = len(f"{published:g}".partition(".")[2])
    sign = -1.0 if least else 1.0
    held = sign * round(found, digits) <= sign * published
    return held, f"; {BY_ROUNDING}" if held and sign * found > sign * published else ""


COLUMNS = tuple(field.name for field in fields(Claim))


def verdict(held: bool | None) -> str:
    """How every table says true, false or neither."""
    return "" if held is None else "true" if held else "false"


def write_claims(path: Path, claims: Sequence[Claim]) -> None:
    """Write claims as CSV."""
    write_csv(path, [claim.row() for claim in claims], COLUMNS)


def read_claims(path: Path) -> list[Claim]:
    """Read claims from CSV.

    Raises:
        InputError: The file is missing or unreadable, lacks a column, or says neither true nor false nor nothing in
            `held`.
    """
    claims = []
    meaning = {verdict(held): held for held in (True, False, None)}
    for row in read_csv(path):
        missing = [column for column in COLUMNS if row.get(column) is None]
        if missing:
            raise InputError(f"column '{missing[0]}' is missing", file=path, key=row.get("claim"))
        if row["held"] not in meaning:
            raise InputError(f"'{row['held']}' is not a verdict", file=path, key="held", allowed="true, false, empty")
        claims.append(Claim(row["claim"], row["thesis"], row["robojoule"], meaning[row["held"]]))
    return claims
