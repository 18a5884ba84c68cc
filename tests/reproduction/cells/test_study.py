"""The study of whole cells: methods differ as they say, and savings come in the order that they must."""

import pytest

from reproduction.cells.study import BRAKES_ON, METHODS, MOTORS_ON, cell_rows, variant
from reproduction.study.config import PlanCellsParams
from tests.planning.robot_cells.cases import three

PARAMS = PlanCellsParams(
    cells=["robot_cell.yaml"], cycle_times_percent=[120], gap_percent=1.0, time_limit_s=900.0, seed=0
)


def test_methods_see_the_cell_as_they_say():
    for method, (planned, modes) in METHODS.items():
        cell = variant(three(), method)
        for one in cell.robots:
            assert len(one.robot.standby) <= len(modes)
            assert all(move.fixed != planned for move in one.program.moves)
    assert [mode.name for mode in variant(three(), "speeds_and_all_modes").robots[0].robot.standby] == [
        "brakes",
        "bus off",
    ]


def test_more_freedom_saves_more():
    rows = {row["method"]: row for row in cell_rows(PARAMS, lambda text: None)}
    assert list(rows) == list(METHODS)
    energy = {method: row["energy_j"] for method, row in rows.items()}
    for less, more in (
        (MOTORS_ON, BRAKES_ON),
        (BRAKES_ON, "modes_alone"),
        (MOTORS_ON, "speeds_alone"),
        (BRAKES_ON, "speeds_and_brakes"),
        ("speeds_alone", "speeds_and_brakes"),
        ("speeds_and_brakes", "speeds_and_all_modes"),
    ):
        assert energy[more] <= 1.01 * energy[less], (less, more)  # within the gap
    best = rows["speeds_and_all_modes"]
    assert best["saving_over_motors_on_percent"] > 10.0
    assert best["saving_over_brakes_percent"] == pytest.approx(100.0 * (1.0 - best["energy_j"] / energy[BRAKES_ON]))
    for row in rows.values():
        assert row["clearance_m"] >= three().safety_distance_m and row["bound_j"] <= row["energy_j"]
