"""Every claim of the thesis that does not hold in the committed tables has a sentence why, and no other has one."""

from pathlib import Path

from reproduction.claims import read_claims
from reproduction.config import load_params
from reproduction.report.page import REASONS, reasons_of
from robojoule.documents import read_document

ROOT = Path(__file__).parents[3]


def test_each_claim_that_fails_has_a_reason():
    known = read_document(REASONS)
    assert known["robot"] == load_params(ROOT / "params.yaml").robot.name
    failed = {claim.claim for claim in read_claims(ROOT / "reports/tables/claims.csv") if claim.held is False}
    assert set(known["reasons"]) == failed
    assert all(reason.endswith(".") for reason in known["reasons"].values())


def test_reasons_are_shown_beside_the_claims_of_that_robot_only():
    known = read_document(REASONS)
    assert reasons_of(known["robot"]) == known["reasons"]
    assert reasons_of("ur_ur10e") == {}
