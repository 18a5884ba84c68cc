import json
from pathlib import Path

import pytest

from reproduction.report.merge import merged_metrics
from robojoule.errors import InputError


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
