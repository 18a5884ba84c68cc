"""Claims of the thesis beside what came out here: how one is said, written and read."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from reproduction.tables import write_csv
from robojoule.documents import read_text
from robojoule.errors import InputError

_HELD = {True: "true", False: "false", None: ""}


@dataclass(frozen=True)
class Claim:
    """A claim of the thesis.

    Attributes:
        claim: What is claimed.
        thesis: Its figures.
        ours: The figures of this reproduction.
        held: Whether the claim holds here; none where that cannot be said.
    """

    claim: str
    thesis: str
    ours: str
    held: bool | None


COLUMNS = tuple(field.name for field in fields(Claim))


def write_claims(path: Path, claims: Sequence[Claim]) -> None:
    """Write claims as CSV."""
    write_csv(path, [asdict(claim) | {"held": _HELD[claim.held]} for claim in claims])


def read_claims(path: Path) -> list[Claim]:
    """Read claims from CSV.

    Raises:
        InputError: The file is missing or unreadable, lacks a column, or says neither true nor false nor nothing in
            `held`.
    """
    claims = []
    held = {text: value for value, text in _HELD.items()}
    for row in csv.DictReader(io.StringIO(read_text(path))):
        missing = [column for column in COLUMNS if row.get(column) is None]
        if missing:
            raise InputError(f"column '{missing[0]}' is missing", file=path, key=row.get("claim"))
        verdict = row["held"].strip().lower()
        if verdict not in held:
            raise InputError(f"'{row['held']}' is not a verdict", file=path, key="held", allowed="true, false, empty")
        claims.append(Claim(row["claim"], row["thesis"], row["ours"], held[verdict]))
    return claims
