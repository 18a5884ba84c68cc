"""Teach pendant programs: read, planned, written, constructs one by one."""

import random

import numpy as np
import pytest

from robojoule.api import optimize
from robojoule.errors import InputError
from robojoule.formats.program import load_program
from robojoule.formats.vendor.fanuc.program import read_teach_pendant
from robojoule.formats.vendor.trace import Beside, CycleStart, JointTarget, Load, Motion, PoseTarget, Unknown, Wait
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload
from tests.formats.vendor.fanuc_text import HOME, PLACES, joints, listing, place, written

ROBOT = "fanuc_m10_12_14d"
CYCLE = ["J P[1] 100% FINE", "J P[2] 100% FINE", "J P[3] 80% FINE", "WAIT    .50(sec)", "J P[1] 100% FINE"]


def events(tmp_path, body, positions=PLACES, beside=None, **more):
    program = read_teach_pendant(written(tmp_path, listing(body, positions, **more)))
    trace = program.trace(beside or Beside())
    return list(trace.events), [str(note) for note in trace.notes]


def labels(found):
    return [event.label for event in found if isinstance(event, Motion)]


def test_joint_positions_are_angles_of_the_pendant(tmp_path):
    program = load_program(written(tmp_path, listing(CYCLE)))
    assert (program.name, program.format, program.angles) == ("CYCLE", "FANUC TP", "pendant")
    found = np.degrees(program.tree.configurations_rad()).round(6).tolist()
    assert found == [list(map(float, PLACES[n])) for n in (1, 2, 3, 1)]
    assert [move.speed_limit_percent for move in program.moves] == [100, 80, 100]
    assert [type(one).__name__ for one in program.tree.operations].count("WaitOperation") == 1


def test_joint_3_includes_joint_2(tmp_path):
    """With the forearm kept level by the pendant's J3, the model's third joint turns as the second does."""
    from robojoule.checks import model_program

    body, positions = ["J P[1] 100% FINE", "J P[2] 50% FINE"], {1: (0, 0, 0, 0, 0, 0), 2: (0, 30, 0, 0, 0, 0)}
    program = model_program(load_program(written(tmp_path, listing(body, positions))), load_robot(ROBOT))
    assert np.degrees(program.moves[0].target_rad).round(6).tolist() == [0, 30, 30, 0, 0, 0]


def test_a_plan_changes_percents_alone_and_the_next_plan_nothing(tmp_path):
    path = written(tmp_path, listing(CYCLE))
    robot = load_robot(ROBOT, payload_kg=5)
    plan = optimize(load_program(path), robot, cycle_time="+40%")
    assert all(move.speed_limit_percent.is_integer() for move in plan.moves)
    plan.save(tmp_path / "new.ls")
    old, new = path.read_text().splitlines(), (tmp_path / "new.ls").read_text().splitlines()
    changed = [(a, b) for a, b in zip(old, new, strict=True) if a != b]
    assert len(changed) == 3 and all(a.split("%")[1:] == b.split("%")[1:] for a, b in changed)
    again = load_program(tmp_path / "new.ls")
    assert [m.speed_limit_percent for m in again.moves] == [m.speed_limit_percent for m in plan.moves]
    second = optimize(again, robot, cycle_time=plan.cycle_time_s)
    assert second.program.diff() == ""


def test_an_inserted_wait_keeps_numbers_of_lines_and_line_count_in_step(tmp_path):
    body = [*CYCLE[:2], "!remark", "J P[3] 80% FINE TB .10sec,P-SPS", *CYCLE[3:]]
    block = "      1:  DO[1]=ON ;\n      2:  DO[2]=OFF ;\n       ------ ;\n"
    text = listing(body).replace("P-SPS ;\n", f"P-SPS ;\n{block}")
    program = load_program(written(tmp_path, text))
    moves = program.moves
    tree = program.tree.with_plan(
        {moves[0].name: 31.0},
        added_waits_before_s={moves[0].name: 0.25},
        added_waits_after_s={moves[1].name: 1.2345, moves[2].name: 0.004},
    )
    (after,) = program.source.texts(tree)
    lines = after.splitlines()
    assert "LINE_COUNT\t= 10;" in lines
    inside = lines[lines.index("/MN") + 1 : lines.index("/POS")]
    assert inside == [
        "   1:J P[1] 100% FINE ;",
        "   2:  !Wait added by robojoule ;",
        "   3:  WAIT   0.25(sec) ;",
        "   4:J P[2] 31% FINE ;",
        "   5:  !remark ;",
        "   6:J P[3] 80% FINE TB .10sec,P-SPS ;",
        *block.splitlines(),
        "   7:  !Wait added by robojoule ;",
        "   8:  WAIT   1.23(sec) ;",  # not longer than the plan says: the cycle time holds
        "   9:  WAIT    .50(sec) ;",
        "  10:J P[1] 100% FINE ;",  # 0.004 s are less than the controller's step
    ]
    again = load_program(written(tmp_path, after, "again.ls"))
    assert [(m.added_wait_before_s, m.added_wait_after_s) for m in again.moves] == [(0.25, 0), (0, 1.23), (0, 0)]
    assert again.source.texts(again.tree) == (after,)
    assert again.source.texts(program.tree) == (text,)  # waits of plans can be taken away again


@pytest.mark.parametrize("count, first", [(9, "   9"), (99, "  99"), (999, " 999"), (9999, "9999")])
def test_numbers_grow_a_digit(tmp_path, count, first):
    body = ["J P[1] 100% FINE", "J P[2] 100% FINE", *["!x"] * (count - 3), "J P[1] 10% FINE"]
    program = load_program(written(tmp_path, listing(body)))
    (after,) = program.source.texts(program.tree.with_plan({}, added_waits_after_s={program.moves[0].name: 1.0}))
    assert f"\n{first}:  !x ;" in after if count > 9 else True
    assert f"\n{count + 2:4d}:J P[1] 10% FINE ;" in after


def test_numbers_behind_a_tab_and_rows_without_order(tmp_path):
    text = listing(CYCLE)
    tabs = "".join(f"\t{line.lstrip()}\n" if line[:4].strip().isdigit() else f"{line}\n" for line in text.splitlines())
    program = load_program(written(tmp_path, tabs))
    (after,) = program.source.texts(program.tree.with_plan({}, added_waits_after_s={program.moves[0].name: 1.0}))
    assert "\t2:J P[2] 100% FINE ;\n\t3:  !Wait added by robojoule ;\n\t4:  WAIT   1.00(sec) ;\n\t5:J P[3]" in after
    mixed = text.replace("   3:", "  30:")
    program = load_program(written(tmp_path, mixed))
    (after,) = program.source.texts(program.tree.with_plan({}, added_waits_after_s={program.moves[0].name: 1.0}))
    assert "  30:J P[3]" in after and "    :  WAIT   1.00(sec) ;" in after and "LINE_COUNT\t= 7;" in after
    again = load_program(written(tmp_path, after))
    assert again.moves[0].added_wait_after_s == 1.0


def test_remarks_and_commented_moves_are_no_moves(tmp_path):
    body = [CYCLE[0], "!J P[2] 100% FINE", "//J P[3] 100% FINE", "--eg:J P[2] 100% FINE", "", CYCLE[2]]
    found, notes = events(tmp_path, body)
    assert labels(found) == ["P[1]", "P[3]"] and len(found) == 2 and notes == []


def test_zones(tmp_path):
    body = [f"J P[{1 + n % 4}] 50% {zone}" for n, zone in enumerate(["FINE", "CNT0", "CNT100", "CNT 50", "CR20"])]
    found, _ = events(tmp_path, [*body, "J P[1] 50% CNT R[3:round]"])
    blends = [None if event.blend is None else (event.blend.share, event.blend.radius_m) for event in found]
    assert blends == [None, None, (1.0, None), (0.5, None), (None, 0.02), (1.0, None)]


def test_waits(tmp_path):
    body = ["WAIT   1.00(sec)", "WAIT .50(sec)", "R[7]=2", "WAIT R[7](sec)", "WAIT R[8](sec)", "WAIT DI[1]=ON", "PAUSE"]
    found, _ = events(tmp_path, body)
    assert [event.duration_s for event in found if isinstance(event, Wait)] == [1.0, 0.5, 2.0, None, None, None]


def test_speeds(tmp_path):
    body = ["J P[1] 100.0% FINE", "J P[2] 1.50sec FINE", "J P[3] 800msec FINE", "J P[4] R[5]% FINE", "R[6]=30"]
    found, _ = events(tmp_path, [*body, "J P[1] R[6]% FINE", "L P[2] 1500mm/sec FINE", "L P[2] WELD_SPEED CNT100"])
    speeds = [event.speed for event in found if isinstance(event, Motion)]
    assert [speed.percent for speed in speeds] == [100, None, None, None, 30, None, None]
    assert [speed.duration_s for speed in speeds[:3]] == [None, 1.5, 0.8]
    assert [speed.writable for speed in speeds] == [True, True, True, False, False, False, False]
    assert [speed.tool_m_s for speed in speeds[5:]] == [1.5, None]
    assert [event.kind for event in found] == ["joint"] * 5 + ["linear"] * 2


def test_motions_over_several_lines(tmp_path):
    text = listing(["J P[1] 100% FINE", "C P[2] CONT", "J P[4] 30% FINE Wjnt"])
    text = text.replace("C P[2] CONT ;", "C P[2]    \n    :  P[3] 100mm/sec FINE    ;").replace(
        "30% FINE Wjnt ;", "30%\n    :  FINE Wjnt ;"
    )
    program = read_teach_pendant(written(tmp_path, text))
    found = program.trace(Beside()).events
    assert labels(found) == ["P[1]", "P[3]", "P[4]"]
    assert found[1].kind == "circular" and found[2].speed.percent == 30
    from robojoule.formats.vendor.trace import Wish

    (edit,) = program.speed_edits({found[2].statement: Wish(12.0)})
    assert text[edit.span.start : edit.span.end] == "30" and edit.text == "12"


def test_places_of_the_tool_with_frames_and_configuration(tmp_path):
    body = ["UFRAME_NUM=2", "UTOOL_NUM=3", "J P[1] 100% FINE", "J P[2] 100% FINE", "J P[3] 100% FINE"]
    figures = (500, -100, 300, 180, -30, 45)
    positions = place(1, figures, uf="F", ut="F") + place(2, figures, "F D B, 0, 0, -1") + place(3, figures, ut="0")
    found, _ = events(tmp_path, body, positions)
    first, second, third = (event.target for event in found)
    assert isinstance(first, PoseTarget)
    assert first.position_m == (0.5, -0.1, 0.3)
    assert first.unknown == "UT 3 and UF 2" and second.unknown == "UT 1" and third.unknown == ""
    assert str(second.configuration) == "F D B, 0, 0, -1"
    half, turn = np.radians(30.0), np.radians(45.0)  # R about z, then P about y, then W = 180 about x
    z_axis = [np.sin(half) * np.cos(turn), np.sin(half) * np.sin(turn), -np.cos(half)]
    np.testing.assert_allclose(third.rotation[:, 2], z_axis, atol=1e-12)


def test_positions_that_are_not_in_the_file(tmp_path):
    body = ["J PR[1] 100% FINE", "J P[9] 100% FINE", "J P[R[1]] 100% FINE", "R[1]=2", "J P[R[1]] 100% FINE"]
    body += ["J P[3] 100% FINE INC", "J P[3] 100% FINE Offset,PR[2]", "J P[3] 100% FINE Tool_Offset,PR[2]"]
    body += ["P[3]=LPOS", "J P[3] 100% FINE"]
    found, _ = events(tmp_path, body)
    assert [isinstance(event.target, JointTarget) for event in found] == [False] * 3 + [True] + [False] * 4
    assert "register" in found[0].reason and "POS" in found[1].reason and "computed" in found[2].reason


@pytest.mark.parametrize("code", ["CALL GRIP(1)", "OPEN_HAND", "RUN OTHER", "Hand open 1", "2 + 2", "J P[1]"])
def test_what_may_move_the_robot_makes_its_position_unknown(tmp_path, code):
    found, _ = events(tmp_path, [CYCLE[0], code, CYCLE[1]])
    assert [type(event) for event in found] == [Motion, Unknown, Motion]


def test_programs_beside_it_that_move_nothing_keep_the_position_known(tmp_path):
    written(tmp_path, listing(["DO[1]=ON", "WAIT   .30(sec)", "CALL SIGNAL"], {}), "GRIP.LS")
    written(tmp_path, listing(["WAIT DI[1]=ON"], {}), "signal.ls")
    written(tmp_path, listing(["J P[2] 100% FINE"]), "go.ls")
    written(tmp_path, listing(["CALL LOOP"], {}), "loop.ls")
    written(tmp_path, b"\0", "bad.ls")
    found, notes = events(tmp_path, [CYCLE[0], "CALL GRIP", CYCLE[1]])
    assert [type(event) for event in found] == [Motion, Wait, Wait, Motion] and "moves nothing" in notes[0]
    assert [found[1].duration_s, found[2].duration_s] == [0.3, None] and found[1].line == found[0].line + 1
    for name in ("GO", "LOOP", "BAD", "MISSING"):
        assert [type(event) for event in events(tmp_path, [CYCLE[0], f"CALL {name}"])[0]] == [Motion, Unknown]
    still = Beside(still=frozenset(["MISSING", "HAND OPEN 1"]))
    assert len(events(tmp_path, [CYCLE[0], "CALL MISSING(1)", "Hand open  1", CYCLE[1]], beside=still)[0]) == 2


@pytest.mark.parametrize(
    "code",
    [
        *("DO[1]=ON", "RO[2:hand]=OFF", "R[1]=R[1]+1", "TIMER[1]=START", "UALM[3]", "MESSAGE[x y]", "COL DETECT ON"),
        *("$MCR.$GENOVERRIDE=50", "$MCR_GRP[1].$PRGOVERRIDE=30", "TC_ONLINE (ON)", "PR[1,3]=R[2]-(20)", "LBL[7:x]"),
        *("DO[1]=PULSE,0.5sec", "IF R[1]=1,JMP LBL[9]", "SKIP CONDITION DI[1]=ON", "F[1]=(DI[1] AND !DI[2])"),
    ],
)
def test_what_moves_nothing_is_passed_over(tmp_path, code):
    found, _ = events(tmp_path, [CYCLE[0], code, CYCLE[1]])
    assert [type(event) for event in found] == [Motion, Motion]


def test_payloads_are_figures_of_the_controller(tmp_path):
    found, _ = events(tmp_path, ["PAYLOAD[2]", CYCLE[0]], beside=Beside(payloads={"2": Payload(7.0)}))
    assert isinstance(found[0], Load) and found[0].payload.mass_kg == 7.0
    found, _ = events(tmp_path, ["PAYLOAD[2:full]", CYCLE[0]])
    assert isinstance(found[0], Load) and found[0].payload is None


def test_a_loop_without_end_is_the_cycle(tmp_path):
    body = [CYCLE[0], "LBL[1]", CYCLE[1], CYCLE[2], "JMP LBL[1]", CYCLE[0]]
    found, _ = events(tmp_path, body)
    assert [type(event) for event in found] == [Motion, CycleStart, Motion, Motion]


def test_jumps_forward_skip_and_conditional_ones_leave_two_ways(tmp_path):
    found, _ = events(tmp_path, [CYCLE[0], "JMP LBL[5]", CYCLE[1], "LBL[5]", CYCLE[2]])
    assert labels(found) == ["P[1]", "P[3]"]
    found, notes = events(tmp_path, [CYCLE[0], "IF DI[1]=ON,JMP LBL[5]", CYCLE[1], "LBL[5]", CYCLE[2]])
    assert [type(event) for event in found] == [Motion, Motion, Unknown, Motion]
    assert "taken not to" in notes[0]
    found, _ = events(tmp_path, [CYCLE[0], "IF DI[1]=ON,JMP LBL[5]", "DO[1]=ON", "LBL[5]", CYCLE[2]])
    assert [type(event) for event in found] == [Motion, Motion]
    found, _ = events(tmp_path, [CYCLE[0], "LBL[5]", CYCLE[1], "IF R[1]<5,JMP LBL[5]", CYCLE[2]])
    assert [type(event) for event in found] == [Motion, Unknown, Motion, Motion]
    found, _ = events(tmp_path, [CYCLE[0], "JMP LBL[77]", CYCLE[1]])
    assert [type(event) for event in found] == [Motion, Unknown]


def test_selections(tmp_path):
    body = [CYCLE[0], "SELECT R[1]=1,JMP LBL[1]", "=2,CALL B", "ELSE,JMP LBL[2]", CYCLE[1], "LBL[1]", "LBL[2]"]
    found, _ = events(tmp_path, body)
    assert [type(event) for event in found] == [Motion, Unknown, Motion, Unknown, Unknown]


def test_blocks_of_if(tmp_path):
    found, _ = events(tmp_path, [CYCLE[0], "IF (DI[1]) THEN", CYCLE[1], "ELSE", "DO[1]=ON", "ENDIF", CYCLE[2]])
    assert [type(event) for event in found] == [Motion, Unknown, Motion]
    found, notes = events(tmp_path, [CYCLE[0], "IF (DI[1]) THEN", "!x", "DO[1]=ON", "ENDIF", CYCLE[2]])
    assert [type(event) for event in found] == [Motion, Motion] and len(notes) == 1


def test_loops_of_a_fixed_count_run(tmp_path):
    body = ["FOR R[1]=2 TO 4", "J P[R[1]] 50% FINE", "ENDFOR", "FOR R[2]=R[1] DOWNTO 3", "J P[R[2]] 50% FINE", "ENDFOR"]
    found, _ = events(tmp_path, body)
    assert labels(found) == ["P[R[1]]"] * 3 + ["P[R[2]]"] * 2
    firsts = [round(np.degrees(event.target.angles_rad[0])) for event in found]
    assert firsts == [60, 90, 20, 20, 90]
    found, _ = events(tmp_path, ["FOR R[1]=1 TO R[9]", CYCLE[1], "ENDFOR"])
    assert [type(event) for event in found] == [Unknown]


def test_the_end_ends(tmp_path):
    assert labels(events(tmp_path, [CYCLE[0], "END", CYCLE[1]])[0]) == ["P[1]"]


def test_groups_and_further_axes(tmp_path):
    found, _ = events(tmp_path, CYCLE[:2], group="*,1,*,*,*")
    assert found[0].target is None and "DEFAULT_GROUP" in found[0].reason
    more = ",\n\tE1=  1429.999  mm\n   GP2:\n\tUF : 1, UT : 1,\t\n\tJ1=   833.743  mm"
    found, _ = events(tmp_path, CYCLE[:1], joints(1, HOME, '"a b"', more))
    assert dict(found[0].target.external) == {"E1": 1429.999, "GP2.J1": 833.743}


def test_positions_that_are_not_taught_or_not_understood(tmp_path):
    bad = "P[2]{\n   GP1:\n\tUF : 0, UT : 1,\n\tX = ******** mm, Y = ******** mm\n};\nP[3]{\n  what\n};\n"
    found, notes = events(tmp_path, CYCLE[:3], joints(1, HOME) + bad + joints(4, HOME))
    assert [event.target is None for event in found] == [False, True, True]
    assert "not taught" in found[1].reason and "not in the section POS" in found[2].reason
    assert any("not understood" in note for note in notes)


def test_what_is_kept_and_not_simulated_is_said(tmp_path):
    _, notes = events(tmp_path, ["OVERRIDE=50%", "J P[1] 100% FINE ACC50", "J P[2] 100% FINE ACC100"])
    assert len(notes) == 2 and "OVERRIDE" in notes[0] and "ACC50" in notes[1]


@pytest.mark.parametrize("text", ["", "/PROG X\n/POS\n/END\n", "hello", "MN\n", "&ACCESS RVP\nDEF x()\nEND\n"])
def test_other_files_are_refused(tmp_path, text):
    with pytest.raises(InputError, match="the file has no section /MN"):
        load_program(written(tmp_path, text))


@pytest.mark.parametrize("body", [[], ["!nothing"], ["J P[1] 100% FINE"], ["CALL A"]])
def test_programs_without_a_motion_that_could_change_are_told(tmp_path, body):
    with pytest.raises(InputError, match="no motion between known positions"):
        load_program(written(tmp_path, listing(body))).tree  # noqa: B018


@pytest.mark.parametrize(
    "body",
    [["FOR R[1]=1 TO 999999999", "ENDFOR"], ["FOR R[1]=1 TO 500", *["FOR R[2]=1 TO 500", "ENDFOR"], "ENDFOR"]],
)
def test_loops_that_run_too_long_are_refused(tmp_path, body):
    with pytest.raises(InputError, match="does not end within"):
        load_program(written(tmp_path, listing(body)))


def test_hostile_nesting_is_survived(tmp_path):
    body = [
        *["IF (DI[1]) THEN"] * 500,
        CYCLE[0],
        *["ENDIF"] * 500,
        CYCLE[0],
        CYCLE[1],
        "J P[" + "[" * 300 + "] 1% FINE",
    ]
    found, _ = events(tmp_path, body)
    assert found


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_program_saved_as_it_is_keeps_every_byte(tmp_path, end):
    content = listing([*CYCLE, "!Gr\xfc\xdfe"]).replace("\n", end).encode("latin-1")
    program = load_program(written(tmp_path, content))
    program.save(tmp_path / "copy.ls")
    assert (tmp_path / "copy.ls").read_bytes() == content


LINES = [
    *("J P[1] 100% FINE", "J P[2] 45% CNT100", "L P[3] 250mm/sec CNT50", "J P[4] 1.2sec FINE", "J PR[1] 5% FINE"),
    *("WAIT   .20(sec)", "WAIT DI[1]=ON", "!remark", "//J P[1] 1% FINE", "DO[1]=ON", "CALL X", "LBL[1]", "JMP LBL[1]"),
    *("IF DI[1],JMP LBL[1]", "FOR R[1]=1 TO 3", "ENDFOR", "IF (DI[1]) THEN", "ELSE", "ENDIF", "END", "R[1]=2"),
    *("J P[R[1]] 30% FINE", "UFRAME_NUM=1", "SELECT R[1]=1,JMP LBL[1]", "???", "", "J P[2] 77% FINE INC"),
    *("macro", "PAYLOAD[1]"),
]


def test_random_programs_survive_reading_and_writing_and_damage(tmp_path):
    """Seeded: programs of random lines, one in two with random characters changed, are written as they were read."""
    chance = random.Random(11)
    read = 0
    for _ in range(200):
        text = listing(["J P[1] 100% FINE", *chance.choices(LINES, k=chance.randrange(1, 14)), "J P[2] 9% FINE"])
        if chance.random() < 0.5:
            for _ in range(chance.randrange(1, 6)):
                at = chance.randrange(len(text))
                text = text[:at] + chance.choice("[]{}();:=%,!/ \t\nJP1*'\"") + text[at + chance.randrange(2) :]
        path = written(tmp_path, text)
        try:
            program = load_program(path)
            texts = program.source.texts(program.tree)
        except InputError as error:
            assert len(str(error)) < 300
            continue
        assert texts == (text,)
        slower = {move.name: 7.0 for move in program.moves if not move.fixed and move.speed_limit_percent > 7.0}
        (after,) = program.source.texts(program.tree.with_plan(slower))
        again = load_program(written(tmp_path, after))
        assert again.source.texts(again.tree) == (after,)
        read += 1
    assert read > 25


def test_what_a_motion_calls_on_its_way_does_not_move_the_robot(tmp_path):
    body = [
        "J P[1] 100% FINE",
        "J P[2] 90% FINE TB .10sec,CALL GRIP",
        "J P[3] 100% CNT50 DB 10.0mm,CALL OPEN(1)",
        CYCLE[-1],
    ]
    found, notes = events(tmp_path, body)
    assert labels(found) == ["P[1]", "P[2]", "P[3]", "P[1]"]
    assert not notes and not any(isinstance(event, Unknown) for event in found)
