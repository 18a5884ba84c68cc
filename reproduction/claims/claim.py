"""One claim of the thesis beside what comes out here, and the one way in which tables say true."""

from __future__ import annotations

from dataclasses import dataclass

from reproduction.tables import Row

CLAIM_COLUMNS = ("claim", "thesis", "ours", "held")


@dataclass(frozen=True)
class Claim:
    """A statement of the thesis, held against the results.

    Attributes:
        claim: The statement.
        thesis: What the thesis found.
        ours: What comes out here.
        held: Whether the result is as good or points the same way; none if it cannot be told.
    """

    claim: str
    thesis: str
    ours: str
    held: bool | None

    def row(self) -> Row:
        """Cells of the claim in a result table."""
        return {"claim": self.claim, "thesis": self.thesis, "ours": self.ours, "held": verdict(self.held)}


def verdict(held: bool | None) -> str:
    """How every table says true, false or neither."""
    return "" if held is None else "true" if held else "false"
