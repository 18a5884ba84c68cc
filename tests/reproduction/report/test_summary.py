"""The first words of the report are figures of its own Table 6.1."""

from reproduction.report.results import Results
from reproduction.report.summary import summary_of

ROWS = [
    {"relaxation_percent": at, "method": method, "saving_percent": saving, "gap_to_optimum_percent": gap, "trees": "30"}
    for at, method, saving, gap in (
        ("110", "predicted_three_segment", "15.86", "6.7"),
        ("110", "robojoule_simulated", "21.08", "0.0023"),
        ("200", "predicted_three_segment", "31.6", "7.0"),
        ("200", "robojoule_simulated", "36.09", "0.0213"),
    )
]


def test_it_says_what_the_table_says(toy_results: Results, monkeypatch):
    monkeypatch.setattr(type(toy_results), "table", lambda self, name: ROWS)
    found = summary_of(toy_results)
    assert found is not None
    assert (found.figure, found.of) == ("21.1 %", "less energy in 10 % more time")
    first, second, third = found.sentences
    assert "30 random programs take 21.1 % less" in first
    assert "and 36.1 % at 200 %" in first
    assert "more than 0.03 %" in second  # of 0.0213, not rounded down
    assert "saves 15.9 % of the same programs; it was 17.4 to 17.6 % in the thesis" in third


def test_without_plans_there_is_none(toy_results: Results, monkeypatch):
    monkeypatch.setattr(type(toy_results), "table", lambda self, name: None)
    assert summary_of(toy_results) is None
