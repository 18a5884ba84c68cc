"""Blocks of splines in KRL: their motions do not stop between each other, and nothing is written into the blocks."""

import re

import pytest

from robojoule.api import optimize
from robojoule.formats.program import load_program
from robojoule.formats.vendor.krl.program import read_krl
from robojoule.formats.vendor.trace import Beside, Motion
from robojoule.formats.vendor.zones import ASSUMED_BLEND
from robojoule.robots import load_robot
from tests.formats.vendor.checks import assert_plan_holds
from tests.formats.vendor.krl_text import HOME

ROBOT = load_robot("kuka_kr16_r2010_2", payload_kg=8)
INNER = "SPTP {A1 40}\nSPTP {A1 60,A2 -70}\nSPTP {A1 20,A2 -80}\n"
BLOCK = f"PTP_SPLINE\n{INNER}ENDSPLINE\n"
FOLD = f";FOLD PTP_SPLINE S1 Vel=80 % ;%{{PE}}\n;Params IlfCommand=SPLINE\n{BLOCK};ENDFOLD\n"


def written(folder, body):
    path = folder / "main.src"
    path.write_text(f"DEF main( )\nBAS(#INITMOV,0)\nBAS(#VEL_PTP,80)\n{body}END\n")
    return path


def motions(folder, body):
    trace = read_krl(written(folder, body)).trace(Beside())
    return [one for one in trace.events if isinstance(one, Motion)], [str(note) for note in trace.notes]


def around(text, block=BLOCK):
    """What stands right before a block that is there as it was, and right behind it."""
    before, behind = text.split(block)
    return before.splitlines()[-1], behind.splitlines()[0]


def test_motions_of_a_block_pass_their_points_and_keep_their_speed(tmp_path):
    found, notes = motions(tmp_path, f"PTP {HOME}\n{BLOCK}PTP {HOME}\n")
    assert [one.speed.writable for one in found] == [True, False, False, False, True]
    assert [one.blend for one in found] == [None, ASSUMED_BLEND, ASSUMED_BLEND, None, None]
    assert [one.speed.percent for one in found] == [80] * 5
    assert notes == [
        "line 5: motions of this block keep their speed, without waits between them; "
        "each is taken to pass its point within half of the way"
    ]


def test_the_end_of_a_block_may_be_passed(tmp_path):
    block = BLOCK.replace("ENDSPLINE", "ENDSPLINE C_SPL")
    found, _ = motions(tmp_path, f"$APO.CDIS=20\nPTP {HOME}\n{block}PTP {HOME}\n")
    assert found[3].blend.radius_m == 0.02


def test_the_head_of_a_block_sets_the_speed_of_its_motions(tmp_path):
    block = BLOCK.replace("PTP_SPLINE", "PTP_SPLINE WITH $VEL_AXIS[1]=SVEL_JOINT(30)")
    found, _ = motions(tmp_path, f"PTP {HOME}\n{block}PTP {HOME}\n")
    assert [one.speed.percent for one in found] == [80, 30, 30, 30, 80]


@pytest.mark.parametrize("block", [BLOCK, FOLD])
def test_a_plan_writes_nothing_into_a_block(tmp_path, block):
    body = f"PTP {HOME}\nPTP {{A1 -60,A2 -70}}\n{block}PTP {{A1 -40}}\nPTP {HOME}\n"
    program = load_program(written(tmp_path, body), ROBOT)
    _, new = assert_plan_holds(program, ROBOT, tmp_path / "new.src", "+30%")
    text = (tmp_path / "new.src").read_text()
    assert block in text and text != program.text
    before, _ = around(text, block)
    assert re.fullmatch(r"BAS\(#VEL_PTP,80\)", before)  # the speed of the block, which the motions before it have not
    assert [move.speed_limit_percent for move in new.moves[1:4]] == [80] * 3


@pytest.mark.parametrize("block", [BLOCK, FOLD])
def test_waits_stand_outside_of_a_block(tmp_path, block):
    program = load_program(written(tmp_path, f"PTP {HOME}\n{block}PTP {HOME}\n"), ROBOT)
    first, _, last, _ = [move.name for move in program.moves]
    tree = program.tree.with_plan({}, added_waits_before_s={first: 0.5}, added_waits_after_s={last: 0.25})
    program.source.save(tree, tmp_path / "new.src")
    before, behind = around((tmp_path / "new.src").read_text(), block)
    assert before.startswith("WAIT SEC 0.5 ;robojoule") and behind.startswith("WAIT SEC 0.25 ;robojoule")
    again = load_program(tmp_path / "new.src", ROBOT)
    assert again.moves[0].added_wait_before_s == 0.5
    assert again.source.diff(program.tree).count("-WAIT SEC") == 2


def test_no_wait_is_placed_between_motions_of_a_block(tmp_path):
    body = f"PTP {HOME}\nPTP {{A1 -60,A2 -70}}\n{BLOCK}PTP {HOME}\n"
    program = load_program(written(tmp_path, body), ROBOT)
    plan = optimize(program, ROBOT, cycle_time="+100%", slowest_speed_limit_percent=50)
    moves = plan.program.moves
    behind = [move.added_wait_after_s for move in moves]
    assert moves[0].added_wait_before_s + sum(behind) > 0.5 and behind[1:3] == [0, 0]
