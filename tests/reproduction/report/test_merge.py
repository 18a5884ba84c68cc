import json
from pathlib import Path

import pytest

from reproduction.report.merge import merged_claims, merged_metrics
from reproduction.report.results import Results
from robojoule.errors import InputError
from tests.reproduction.report import toy


@pytest.fixture
def empty(tmp_path: Path, toy_results: Results) -> Results:
    for name in ("tables", "metrics"):
        (tmp_path / "reports" / name).mkdir(parents=True)
    return toy.results(tmp_path, toy_results.robot)


def put(results: Results, name: str, text: str) -> None:
    (results.files.tables_dir / f"{name}.csv").write_text(text, encoding="utf-8")


def test_claims_follow_the_chapters_whatever_exists(empty: Results):
    assert merged_claims(empty) == []
    put(empty, "claims_plans", "claim,thesis,ours,held\nc,t,o,true\n")
    put(empty, "claims_features", 'claim,thesis,ours,held\n"a, and b",t,o,false\nd,t,o,\n')
    rows = merged_claims(empty)
    assert [(row["claim"], row["held"]) for row in rows] == [("a, and b", "false"), ("d", ""), ("c", "true")]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("claim,thesis,ours\nc,t,o\n", r"claims_plans\.csv.*column 'held' is missing"),
        ("claim,thesis,ours,held\nc,t,o,maybe\n", r"claims_plans\.csv, held: 'maybe' is not a verdict"),
        ("claim,thesis,ours,held\nc,t\n", r"claims_plans\.csv, c: column 'ours' is missing"),
    ],
)
def test_broken_claims_are_refused(empty: Results, text: str, message: str):
    put(empty, "claims_plans", text)
    with pytest.raises(InputError, match=message):
        merged_claims(empty)


def test_metrics_stand_under_their_group(tmp_path: Path):
    for name, value in (("plans", {"optimum": {"110": {"saving_percent": 1.5}}}), ("energy_model", {"x_w": 430})):
        (tmp_path / f"{name}.json").write_text(json.dumps(value), encoding="utf-8")
    (tmp_path / "other.json").write_text("{}", encoding="utf-8")
    merged = merged_metrics(tmp_path)
    assert list(merged) == ["energy_model", "plans"]
    assert merged["plans"]["optimum"]["110"]["saving_percent"] == 1.5


@pytest.mark.parametrize("text", ["{", "[1]"])
def test_broken_metrics_are_refused(tmp_path: Path, text: str):
    (tmp_path / "plans.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"plans\.json"):
        merged_metrics(tmp_path)
