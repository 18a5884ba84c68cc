"""Lines that run several times, and durations of motions with zones, move by move."""

import re

import numpy as np
import pytest

from robojoule.api import optimize, simulate
from robojoule.formats.program import load_program
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import load_robot
from tests.formats.vendor.test_damaged_programs import A, B, C, axes, jointtarget, krl, rapid, script

KR, UR = load_robot("kuka_kr16_r2010_2", payload_kg=3), load_robot("ur_ur10e", payload_kg=3)
HOME, NEAR, FAR = ([0, -1.2, 1.6, -1.9, -1.5, 0], [0.4, -1.2, 1.6, -1.9, -1.5, 0], [1.2, -0.9, 1.4, -1.9, -0.6, 0.5])


def loaded(tmp_path, name, text, robot):
    path = tmp_path / name
    path.write_text(text)
    return load_program(path, robot)


def test_a_leading_speed_on_different_ways_is_kept_and_told(tmp_path):
    """The first pass comes from HOME, the second from NEAR: another joint leads there, 0.8 rad/s is another share."""
    loop = ["i=0", "while i<2:", f"  movej({FAR}, v=0.8)", f"  movej({NEAR}, v=0.8)", "  i=i+1", "end"]
    program = loaded(tmp_path, "cell.script", script(f"movej({HOME})", *loop, f"movej({HOME}, v=0.8)"), UR)
    far, near, again, near_again, home = program.moves
    said = "line 5: the motion runs 2 times on different ways, on which one figure means different speeds"
    assert f"{said}: its speed is kept" in program.notes
    assert far.fixed and again.fixed and far.speed_limit_percent != again.speed_limit_percent
    for move, start in ((far, HOME), (again, NEAR)):
        turned = np.abs(np.subtract(FAR, start))
        leading = 0.8 * turned / turned.max()
        assert move.speed_limit_percent == pytest.approx(100.0 * (leading / UR.velocity_rad_s).max(), rel=2e-4)
    assert near.speed_group == near_again.speed_group is not None  # always from FAR
    assert "line 6: the motion runs 2 times: one speed counts for all" in program.notes
    plan = optimize(program, UR, cycle_time="+30%")
    changed = [line for line in plan.program.diff().splitlines() if line.startswith("-  ")]
    assert not any(str(FAR) in line for line in changed)
    assert any(str(NEAR) in line for line in changed)
    plan.save(tmp_path / "planned.script")
    run = simulate(load_program(tmp_path / "planned.script", UR), UR)
    assert (run.cycle_time_s, run.energy_j) == pytest.approx((plan.cycle_time_s, plan.energy_j))
    assert home.speed_group is None


def test_a_leading_speed_on_ways_that_the_same_joint_leads_is_one_for_all(tmp_path):
    far = [1.2, *FAR[1:4], -1.5, 0.5]
    loop = ["i=0", "while i<2:", f"  movej({far}, v=0.8)", f"  movej({NEAR}, v=0.8)", "  i=i+1", "end"]
    program = loaded(tmp_path, "cell.script", script(f"movej({HOME})", *loop, f"movej({HOME}, v=0.8)"), UR)
    assert not any(move.fixed for move in program.moves)
    plan = optimize(program, UR, cycle_time="+30%")
    plan.save(tmp_path / "planned.script")
    again = load_program(tmp_path / "planned.script", UR)
    run = simulate(again, UR)
    assert (run.cycle_time_s, run.energy_j) == pytest.approx((plan.cycle_time_s, plan.energy_j))
    assert again.moves[0].speed_limit_percent == again.moves[2].speed_limit_percent < 38.2


def test_a_share_of_the_limits_is_the_same_on_every_way(tmp_path):
    body = ["BAS(#VEL_PTP,60)", f"PTP {axes(A)}", "FOR I=1 TO 2", f"PTP {axes(B)}", f"PTP {axes(C)}", "ENDFOR"]
    program = loaded(tmp_path, "cell.src", krl(*body, f"PTP {axes(A)}"), KR)
    assert not any(move.fixed for move in program.moves)
    assert sum("one speed counts for all" in note for note in program.notes) == 1
    assert any(note.startswith("2 lines (6, 7): the motion runs 2 times") for note in program.notes)


def test_durations_of_blended_motions_are_written_move_by_move(tmp_path):
    r"""\T of each move is what it takes from stop to stop at the speed limit that the plan has for it."""
    zones = [jointtarget(point, 1.6).replace("fine", "z50") for point in (B, C)]
    program = loaded(tmp_path, "cell.mod", rapid(jointtarget(A), *zones, jointtarget(A, 1.9)), KR)
    assert [move.is_fine for move in program.moves] == [False, False, True]
    said = "the duration of the motion is taken for that from stop to stop, as if no zone joined it to another"
    assert f"3 lines (4, 5, 6): {said}" in program.notes
    plan = optimize(program, KR, cycle_time="+25%")
    plan.save(tmp_path / "planned.mod")
    written = [float(text) for text in re.findall(r"\\T:=([0-9.]+)", (tmp_path / "planned.mod").read_text())][1:]
    points = np.radians([[float(value) for value in text.split(",")] for text in (A, B, C, A)])
    limits = np.array([[move.speed_limit_percent / 100.0] for move in plan.program.moves])
    alone = MotionPaths(KR, points[:-1], points[1:]).durations(limits)[:, 0]
    np.testing.assert_allclose(written, alone, atol=2e-5)
    again = load_program(tmp_path / "planned.mod", KR)
    run = simulate(again, KR)
    assert (run.cycle_time_s, run.energy_j) == pytest.approx((plan.cycle_time_s, plan.energy_j))
