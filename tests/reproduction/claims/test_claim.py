"""The one way in which tables say true."""

import pytest

from reproduction.claims.claim import CLAIM_COLUMNS, Claim


@pytest.mark.parametrize(("held", "text"), [(True, "true"), (False, "false"), (None, "")])
def test_a_claim_is_one_row(held, text):
    row = Claim("it saves", "10 %", "11 %", held).row()
    assert tuple(row) == CLAIM_COLUMNS
    assert list(row.values()) == ["it saves", "10 %", "11 %", text]
