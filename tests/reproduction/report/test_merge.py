import json
from pathlib import Path

import pytest

from reproduction.report.merge import headline, merged_metrics
from robojoule.errors import InputError
from tests.conftest import ROOT


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


def test_the_headline_is_that_of_the_committed_metrics():
    """Each figure found again by hand in reports/metrics.json."""
    metrics = json.loads((ROOT / "reports/metrics.json").read_text(encoding="utf-8"))
    found = headline(metrics)
    assert list(found) == ["forest_error", "krc_gap", "thesis_gap", "gap", "saving"]
    assert found["forest_error"] == pytest.approx(
        metrics["predictors"]["energy_saving_j"]["random_forest"]["rel_p50_percent"], abs=6e-4
    )
    plans = metrics["plans"]["robojoule_predicted"]
    savings = [plans[percent]["saving_percent"] for percent in ("110", "121", "133", "150", "175", "200")]
    assert found["saving"] == pytest.approx(sum(savings) / 6, abs=6e-4)


def test_a_headline_of_nothing_is_empty():
    assert headline({}) == {}
