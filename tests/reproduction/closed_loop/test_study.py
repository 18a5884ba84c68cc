"""The study from its parameters to its tables, small."""

import pytest

from reproduction.closed_loop.study import closed_loop_cases
from reproduction.closed_loop.summary import TARGETS, machine_rows, target_rows
from tests.reproduction.closed_loop.cases import PARAMS, small


@pytest.fixture(scope="module")
def cases():
    return closed_loop_cases(small(), PARAMS.motions, lambda text: None)


def test_every_machine_is_looked_at_in_every_way(cases):
    machines = {row["machine"] for row in cases}
    assert len(machines) == 8
    assert len(cases) == 8 * (2 + 1) * 2  # draws of a trace and of a stopwatch, after one and two trials
    again = closed_loop_cases(small(), PARAMS.motions, lambda text: None)
    assert again == cases


def test_tables_hold_means_and_worst_cases(cases):
    rows = machine_rows(cases)
    assert len(rows) == 8 * 2 * 2
    for row in rows:
        assert row["late_mean_percent"] <= row["late_worst_percent"]
        found = [
            one["late_percent"]
            for one in cases
            if (one["look"], one["machine"], one["trial"]) == (row["look"], row["machine"], row["trials"])
        ]
        assert row["late_worst_percent"] == pytest.approx(max(found), abs=1e-4)
        assert row["cases"] == len(found)


def test_targets_are_judged_on_traces_by_what_the_machine_lets_foresee(cases):
    rows = target_rows(cases)
    assert len(rows) == 2 * len(TARGETS) + 4
    (worst,) = [
        row for row in rows if (row["target"], row["machines"], row["trials"]) == ("late_percent, worst", "outside", 2)
    ]
    found = [
        max(row["late_percent"] - row["own_deviation_percent"], 0.0)
        for row in cases
        if not row["inside"] and row["trial"] == 2 and row["look"] == "trace"
    ]
    assert worst["value"] == pytest.approx(max(found), abs=1e-4)
    assert worst["held"] == ("true" if max(found) <= 0.2 else "false")
