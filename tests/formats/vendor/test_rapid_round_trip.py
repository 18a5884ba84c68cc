"""RAPID programs: read for a robot, planned, written as they were but for durations and waits."""

import random

import numpy as np
import pytest

from robojoule.api import optimize
from robojoule.errors import InputError
from robojoule.formats.program import load_program
from robojoule.formats.vendor.rapid.program import read_rapid
from robojoule.formats.vendor.trace import Beside
from robojoule.robots import load_robot
from robojoule.robots.arm_configuration import QuarterTurns
from robojoule.robots.inverse_kinematics import flange_placement
from robojoule.robots.rigid_body import quaternions
from tests.formats.vendor.rapid_text import CYCLE, NONE, ROBOT, events, module, written


def test_joint_targets(tmp_path):
    robot = load_robot(ROBOT, payload_kg=5)
    program = load_program(written(tmp_path, module(CYCLE))).for_robot(robot)
    assert (program.name, program.format) == ("cycle", "ABB RAPID")
    found = np.degrees(program.tree.configurations_rad()).round(6).tolist()
    assert found == [[0, 0, 0, 0, 30, 0], [60, 20, 10, 0, 40, 0], [90, 40, -10, 20, 50, 60], [0, 0, 0, 0, 30, 0]]
    assert [move.name for move in program.moves] == ["j1", "j2", "jHome-1"]


def test_a_plan_writes_durations_and_the_next_plan_nothing(tmp_path):
    path, robot = written(tmp_path, module(CYCLE)), load_robot(ROBOT, payload_kg=5)
    plan = optimize(load_program(path), robot, cycle_time="+30%")
    plan.save(tmp_path / "new.mod")
    text = (tmp_path / "new.mod").read_text()
    assert "MoveAbsJ j1\\NoEOffs,v5000\\T:=" in text and "; ! to the part" in text
    again = load_program(tmp_path / "new.mod").for_robot(robot)
    assert [m.speed_limit_percent for m in again.moves] == [m.speed_limit_percent for m in plan.moves]
    second = optimize(again, robot, cycle_time=plan.cycle_time_s)
    assert second.program.diff() == ""


def test_durations_that_stand_there_are_read_and_replaced(tmp_path):
    robot = load_robot(ROBOT)
    program = load_program(written(tmp_path, module(CYCLE.replace("j2,v7000", "j2,v100\\T:=2.5")))).for_robot(robot)
    slow = program.moves[1]
    tree = program.tree.with_plan({slow.name: 7.0})
    (after,) = program.source.texts(tree)
    again = load_program(written(tmp_path, after, "again.mod")).for_robot(robot)
    assert again.moves[1].speed_limit_percent == 7.0
    assert "j2,v100\\T:=" in after and "2.5" not in after.partition("j2,v100")[2].splitlines()[0]


def test_a_duration_that_the_robot_cannot_keep_is_told(tmp_path):
    robot = load_robot(ROBOT)
    program = load_program(written(tmp_path, module(CYCLE.replace("j2,v7000", "j2,v100\\T:=0.1")))).for_robot(robot)
    (note,) = (note for note in program.notes if "longer than the program says" in note)
    assert "by the robot's figures the motion takes" in note


def test_waits_of_plans_come_and_go(tmp_path):
    text = module(CYCLE)
    robot = load_robot(ROBOT)
    program = load_program(written(tmp_path, text)).for_robot(robot)
    first, second, third = (move.name for move in program.moves)
    tree = program.tree.with_plan(
        {}, added_waits_before_s={first: 0.25}, added_waits_after_s={first: 1.2345, second: 0.0004, third: 2.0}
    )
    (after,) = program.source.texts(tree)
    assert after.count("!robojoule: wait added by a plan") == 3
    assert "\n    WaitTime 1.234; !robojoule" in after
    again = load_program(written(tmp_path, after, "again.mod")).for_robot(robot)
    assert [m.added_wait_after_s for m in again.moves] == [1.234, 0, 2]
    assert again.moves[0].added_wait_before_s == 0.25
    assert again.source.texts(again.tree) == (after,)
    (back,) = again.source.texts(program.tree)
    assert back == text


def test_inline_targets_and_a_pose_that_the_arm_reaches(tmp_path):
    robot = load_robot(ROBOT)
    q = np.radians([10.0, -80.0, 100.0, 20.0, 40.0, 30.0])
    place = flange_placement(robot, q)
    x, y, z = place.origin_m * 1e3
    turn = ",".join(f"{part:.9f}" for part in quaternions(place.rotation[..., None])[0])
    conf = QuarterTurns.of(robot, q)
    target = f"[[{x:.4f},{y:.4f},{z:.4f}],[{turn}],[{conf.cf1},{conf.cf4},{conf.cf6},{conf.cfx}],{NONE}]"
    body = f"    MoveAbsJ [[0,-90,90,0,0,0],{NONE}],v1000,fine,tool0;\n    MoveJ {target},v1000,fine,tool0;"
    program = load_program(written(tmp_path, module(body))).for_robot(robot)
    np.testing.assert_allclose(program.moves[0].target_rad, q, atol=1e-5)


def test_a_file_without_main_or_procedure(tmp_path):
    text = module(CYCLE).replace("PROC main()", "PROC path1()")
    assert len(read_rapid(written(tmp_path, text)).trace(Beside()).events) > 4
    other = "  PROC path2()\n  ENDPROC\n"
    trace = read_rapid(written(tmp_path, text.replace("ENDMODULE", f"{other}ENDMODULE"))).trace(Beside())
    assert [str(note) for note in trace.notes] == [
        "line 13: there is no PROC main: PATH1 is planned, other procedures are kept"
    ]
    for text in ("", "hello", "MODULE x\nENDMODULE\n", "%%%"):
        with pytest.raises(InputError, match="the file has no procedure"):
            load_program(written(tmp_path, text))


@pytest.mark.parametrize(
    "body",
    ["    FOR i FROM 1 TO 1E9 DO\n    ENDFOR", "    VAR num n:=0;\n    WHILE n<1 DO\n    n:=n-1;\n    ENDWHILE"],
)
def test_loops_that_run_too_long_are_refused(tmp_path, body):
    with pytest.raises(InputError, match="does not end within"):
        load_program(written(tmp_path, module(body)))


def test_blocks_within_each_other_are_read(tmp_path):
    body = "    IF TRUE THEN\n" * 300 + CYCLE + "\n    ENDIF" * 300
    assert events(tmp_path, body)[0]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_program_saved_as_it_is_keeps_every_byte(tmp_path, end):
    content = module(f"{CYCLE}\n    ! Gr\xfc\xdfe").replace("\n", end).encode("latin-1")
    program = load_program(written(tmp_path, content)).for_robot(load_robot(ROBOT))
    program.save(tmp_path / "copy.mod")
    assert (tmp_path / "copy.mod").read_bytes() == content


LINES = [
    *("MoveAbsJ j1,v1000,fine,tGrip;", "MoveAbsJ j2\\NoEOffs,v500\\T:=2.5,z10,tGrip;", "WaitTime 0.2;", "Set do1;"),
    *("MoveAbsJ jHome,v5000,z50,tGrip; MoveAbsJ j1,vmax,fine,tGrip;", "! remark", "WaitDI di1,1;", "elsewhere;"),
    *("IF di1=1 THEN", "ELSE", "ENDIF", "FOR i FROM 1 TO 2 DO", "ENDFOR", "TEST n", "CASE 1:", "ENDTEST", "RETURN;"),
    *("WHILE TRUE DO", "ENDWHILE", "n:=n+1;", "MoveAbsJ jX,v100,fine,tGrip;", "%%%", "ERROR", "GripLoad load0;"),
]


def test_random_programs_survive_reading_and_writing_and_damage(tmp_path):
    """Seeded: programs of random lines, one in two with random characters changed, are written as they were read."""
    chance, robot = random.Random(12), load_robot(ROBOT)
    read = 0
    for _ in range(120):
        inner = [LINES[0], *chance.choices(LINES, k=chance.randrange(1, 12)), LINES[1], LINES[0]]
        text = module("\n".join(f"    {line}" for line in inner))
        if chance.random() < 0.5:
            for _ in range(chance.randrange(1, 6)):
                at = chance.randrange(len(text))
                text = text[:at] + chance.choice('[]{}();:=%,!\\ \t\n"MJ1*') + text[at + chance.randrange(2) :]
        try:
            program = load_program(written(tmp_path, text)).for_robot(robot)
            texts = program.source.texts(program.tree)
        except InputError as error:
            assert len(str(error)) < 300
            continue
        assert texts == (text,)
        slower = {move.name: 3.0 for move in program.moves if not move.fixed and move.speed_limit_percent > 3.0}
        waits = {move.name: 0.125 for move in program.moves if move.is_fine}
        tree = program.source.placed(program.tree.with_plan(slower, added_waits_after_s=waits))
        (after,) = program.source.texts(tree)
        again = load_program(written(tmp_path, after)).for_robot(robot)
        assert again.source.texts(again.tree) == (after,)
        if any(move.is_fine and move.name not in program.source.resolution.repeated for move in program.moves):
            assert [m.added_wait_after_s for m in again.moves] == [m.added_wait_after_s for m in tree.moves()]
        read += 1
    assert read > 25
