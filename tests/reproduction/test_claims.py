from pathlib import Path

import pytest

from reproduction.claims import BY_ROUNDING, COLUMNS, Claim, held_as_printed, read_claims, write_claims
from robojoule.errors import InputError


@pytest.mark.parametrize(("held", "text"), [(True, "true"), (False, "false"), (None, "")])
def test_a_claim_is_one_row(held: bool | None, text: str):
    row = Claim("it saves", "10 %", "11 %", held).row()
    assert tuple(row) == COLUMNS
    assert list(row.values()) == ["it saves", "10 %", "11 %", text]


@pytest.mark.parametrize(
    ("found", "published", "least", "held", "by_rounding"),
    [
        (4.9, 5.0, False, True, False),
        (5.04, 5.0, False, True, True),  # printed as 5
        (5.6, 5.0, False, False, False),
        (5.04, 4.8, False, False, False),
        (4.84, 4.8, False, True, True),
        (79.6, 80.0, True, True, True),
        (79.4, 80.0, True, False, False),
        (81.0, 80.0, True, True, False),
        (float("nan"), 5.0, False, False, False),
    ],
)
def test_figures_are_held_with_the_digits_that_were_printed(found, published, least, held, by_rounding):
    verdict, remark = held_as_printed(found, published, least=least)
    assert (verdict, BY_ROUNDING in remark) == (held, by_rounding)


def test_claims_are_read_as_they_were_written(tmp_path: Path):
    claims = [Claim("a, and b", "t", "o", False), Claim("d", "t", "o", None), Claim("c", "t", "o", True)]
    path = tmp_path / "reports" / "claims.csv"
    write_claims(path, claims)
    text = 'claim,thesis,robojoule,held\n"a, and b",t,o,false\nd,t,o,\nc,t,o,true\n'
    assert path.read_text(encoding="utf-8") == text
    assert read_claims(path) == claims


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("claim,thesis,robojoule\nc,t,o\n", r"plans\.csv.*column 'held' is missing"),
        ("claim,thesis,robojoule,held\nc,t,o,maybe\n", r"plans\.csv, held: 'maybe' is not a verdict"),
        ("claim,thesis,robojoule,held\nc,t\n", r"plans\.csv, c: column 'robojoule' is missing"),
    ],
)
def test_broken_claims_are_refused(tmp_path: Path, text: str, message: str):
    (tmp_path / "plans.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_claims(tmp_path / "plans.csv")
