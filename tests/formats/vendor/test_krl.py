"""KRL programs: what is read of each construct, and that plans change nothing but speeds and waits."""

import random
import re
from dataclasses import replace

import numpy as np
import pytest

from robojoule.api import optimize, simulate
from robojoule.errors import InputError
from robojoule.formats.program import load_program
from robojoule.formats.vendor.controller_data import read_controller_data
from robojoule.formats.vendor.trace import Beside
from robojoule.programs.operation_tree import CoarseZone, WaitOperation
from robojoule.programs.sections import unknown_operations
from robojoule.robots import load_robot
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload
from tests.formats.vendor.checks import assert_plan_holds, in_degrees
from tests.formats.vendor.krl_text import AT, AT_HOME, CASES, DAT, HOME, LOADS, TO, Case, inline, spline

ROBOT = load_robot("kuka_kr16_r2010_2", payload_kg=8)


def write(folder, body, dat="", name="cycle"):
    text = body if "DEF " in body else f"DEF {name}( )\n{body}\nEND\n"
    (folder / f"{name}.src").write_bytes(text.encode() if isinstance(text, str) else text)
    if dat:
        (folder / f"{name}.dat").write_text(dat)
    return folder / f"{name}.src"


def read(folder, body, dat="", robot=None, **settings):
    return load_program(write(folder, body, dat), robot, **settings)


@pytest.mark.parametrize("name", CASES)
def test_each_construct_is_read(tmp_path, name):
    case: Case = CASES[name]
    program = read(tmp_path, case.body, case.dat, ROBOT if case.robot else None)
    found = in_degrees(program)
    assert len(found) == len(case.positions)
    for row, wanted in zip(found, case.positions, strict=True):
        assert wanted is None or np.allclose(row, wanted, atol=1e-6)
    if case.percents is not None:
        assert [move.speed_limit_percent for move in program.moves] == case.percents
    if case.radii_mm is not None:
        zones = [1e3 * m.zone.radius_m if isinstance(m.zone, CoarseZone) else 0 for m in program.moves]
        assert zones == pytest.approx(case.radii_mm)
    assert [one.duration_s for one in program.tree.atomic() if isinstance(one, WaitOperation)] == case.waits_s
    assert len(unknown_operations(program.tree)) == case.unknown
    for text in case.notes:
        assert any(text in note for note in program.notes), program.notes
    assert (program.angles, program.format) == ("pendant", "KUKA KRL")


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_what_is_saved_as_it_is_keeps_every_byte(tmp_path, name, end):
    case: Case = CASES[name]
    body = case.body if "DEF " in case.body else f"&ACCESS RVP\nDEF cycle( )\n{case.body} ;Gr\xfc\xdfe\nEND"
    content = body.replace("\n", end).encode("latin-1")
    (tmp_path / "cycle.src").write_bytes(content)
    if case.dat:
        (tmp_path / "cycle.dat").write_text(case.dat)
    program = load_program(tmp_path / "cycle.src", ROBOT)
    assert program.diff() == ""
    program.save(tmp_path / "copy.src")
    assert (tmp_path / "copy.src").read_bytes() == content
    assert (tmp_path / "copy.dat").exists() == bool(case.dat)


PLANNED = [name for name, case in CASES.items() if case.radii_mm is None]


@pytest.mark.parametrize("name", PLANNED)
def test_each_construct_is_planned_and_written(tmp_path, name):
    case: Case = CASES[name]
    plan, new = assert_plan_holds(read(tmp_path, case.body, case.dat), ROBOT, tmp_path / "new.src")
    assert np.array_equal(in_degrees(new), in_degrees(plan.program))


def test_folds_code_and_motion_data_stay_in_step(tmp_path):
    dat = DAT.replace("PDEFAULT={VEL 100", "PDEFAULT={VEL 80")
    body = inline("HOME", 80) + inline("P1", 80) + spline("P2", 55, "PPDAT1") + inline("HOME", 80)
    plan, _ = assert_plan_holds(read(tmp_path, body, dat), ROBOT, tmp_path / "new.src")
    text, data = (tmp_path / "new.src").read_text(), (tmp_path / "new.dat").read_text()
    first, second, third = (f"{move.speed_limit_percent:g}" for move in plan.moves)
    assert f"P1 Vel= {first} %" in text and f"2:P1, 3:, 5:{first}, 7:" in text and f"PARAMS,{first})" in text
    assert f"P2 Vel={second} %" in text and f"Kuka.VelocityPtp={second};" in text and f"SVEL_JOINT({second}.0)" in text
    assert text.count(f"Vel= {third} %") == 1
    assert "PDEFAULT={VEL 80.000" in data  # motions that share it differ
    assert "PPDAT1={VEL 60.0" in data  # it was not in step


def test_motion_data_of_one_motion_follow_it(tmp_path):
    dat = DAT.replace("PPDAT1={VEL 60.0", "PPDAT1={VEL 90.0")
    plan, _ = assert_plan_holds(
        read(tmp_path, inline("HOME") + inline("P1", 90, data="PPDAT1"), dat), ROBOT, tmp_path / "new.src"
    )
    assert f"PPDAT1={{VEL {plan.moves[0].speed_limit_percent:.1f},ACC" in (tmp_path / "new.dat").read_text()


def test_a_modal_speed_of_several_motions_gets_company(tmp_path):
    body = f"PTP {HOME}\nBAS(#VEL_PTP,80)\nPTP {TO}\nPTP {{A1 -20,A5 0}}\nPTP {HOME}"
    plan, _ = assert_plan_holds(read(tmp_path, body), ROBOT, tmp_path / "new.src")
    speeds = [float(text) for text in re.findall(r"BAS\(#VEL_PTP,(\d+)\)", (tmp_path / "new.src").read_text())]
    wanted = [move.speed_limit_percent for move in plan.moves]
    assert len(set(wanted)) > 1
    assert speeds == [one for one, before in zip(wanted, [None, *wanted], strict=False) if one != before]


def test_motions_that_may_not_run_keep_their_speed(tmp_path):
    body = f"BAS(#VEL_PTP,80)\nPTP {HOME}\nPTP {TO}\nIF $IN[1] THEN\nPTP {{A1 9}}\nENDIF\nPTP {TO}\nPTP {HOME}"
    assert_plan_holds(read(tmp_path, body), ROBOT, tmp_path / "new.src")
    lines = (tmp_path / "new.src").read_text().splitlines()
    at = lines.index("PTP {A1 9}")
    assert [line for line in lines[:at] if "VEL_PTP" in line][-1] == "BAS(#VEL_PTP,80)"


def test_waits_that_a_plan_adds_go_again(tmp_path):
    program = read(tmp_path, f"PTP {HOME}\nPTP {TO}\nPTP {HOME}")
    slow = optimize(program, ROBOT, cycle_time=60.0, slowest_speed_limit_percent=50)
    slow.save(tmp_path / "slow.src")
    text = (tmp_path / "slow.src").read_text()
    assert re.search(r"^WAIT SEC \d+\.\d+ ;robojoule: wait added by a plan$", text, re.M)
    fast = optimize(load_program(tmp_path / "slow.src"), ROBOT, cycle_time=10.0, slowest_speed_limit_percent=50)
    fast.save(tmp_path / "fast.src")
    assert simulate(load_program(tmp_path / "fast.src"), ROBOT).cycle_time_s == pytest.approx(10.0, abs=0.011)
    kept = [
        line for line in (tmp_path / "fast.src").read_text().splitlines() if "WAIT" not in line and "VEL" not in line
    ]
    assert kept == (tmp_path / "cycle.src").read_text().splitlines()


def test_waits_take_their_length_from_beside(tmp_path):
    body = f"PTP {HOME}\nPTP {TO}\nWAIT FOR $IN[1]\nPTP {HOME}"
    program = read(tmp_path, body, beside=Beside(waits_s={4: 1.5}))
    assert optimize(program, ROBOT, cycle_time=6.0).cycle_time_s == pytest.approx(6.0, abs=0.011)
    with pytest.raises(InputError, match=r"cycle\.src, line 3: there is no wait of unknown .*; allowed: lines: 4"):
        read(tmp_path, body, beside=Beside(waits_s={3: 1.5}))
    with pytest.raises(
        InputError, match=r"nobody knows how long line 4 takes, so a cycle time in seconds says nothing"
    ):
        optimize(read(tmp_path, body), ROBOT, cycle_time=6.0)


def test_a_tool_is_given_beside(tmp_path):
    case: Case = CASES["a tool that is elsewhere"]
    tool = Placement.of((0.0, 0.0, 0.1), (0.0, 0.0, 0.0))
    body = case.body.replace("X 1173,", "X 1273,")
    for beside in (Beside(tool=tool), Beside(tools={"3": tool})):
        found = in_degrees(read(tmp_path, body, robot=ROBOT, beside=beside))
        assert np.allclose(found[2], AT_HOME, atol=1e-6)
        assert np.allclose(found[3], AT, atol=1e-6)


def test_places_need_a_robot_and_say_so(tmp_path):
    program = read(tmp_path, CASES["home as a place"].body)
    with pytest.raises(InputError, match=r"cycle\.src, line 4: the target of the motion is a place of the tool, which"):
        program.tree  # noqa: B018
    assert len(program.for_robot(ROBOT).moves) == 1


HOSTILE = {
    "empty": b"",
    "no motion": b"DEF a( )\nEND\n",
    "zeros": b"DEF a( )\0\n",
    "one motion": f"PTP {HOME}".encode(),
    "a loop without end of its own": b"INT N\nN=1\nWHILE N>0\nN=N+1\nENDWHILE\n",
    "it calls itself": b"DEF a( )\na()\nEND\n",
    "blocks within blocks": b"IF TRUE THEN\n" * 500,
    "brackets within brackets": b"X=" + b"(" * 5000 + b"1" + b")" * 5000,
    "signs behind signs": b"X=" + b"-" * 5000 + b"1",
    "indices within indices": b"X=" + b"A[" * 5000 + b"1" + b"]" * 5000,
    "no text at all": bytes(range(1, 256)) * 20,
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_get_one_sentence(tmp_path, name):
    (tmp_path / "a.src").write_bytes(HOSTILE[name])
    with pytest.raises(InputError) as caught:
        load_program(tmp_path / "a.src")
    assert str(tmp_path / "a.src") in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("seed", range(8))
def test_any_damage_is_read_or_refused_and_never_changed(tmp_path, seed):
    """Characters lost, doubled and swapped in a program: it is refused in one sentence, or saved as it was."""
    chance = random.Random(seed)
    body = "".join(case.body + "\n" for case in CASES.values() if "DEF " not in case.body and not case.robot)
    for number in range(12):
        text = list(f"DEF cycle( )\n{chance.choice([body, inline('P1', 80) + spline('P2')])}\nEND\n")
        for _ in range(chance.randint(1, 30)):
            place = chance.randrange(len(text))
            text[place] = chance.choice(["", text[place] * 2, chance.choice(' {}()",;=\n$#0\xe4'), text[place - 1]])
        content = "".join(text).encode("latin-1")
        (tmp_path / f"c{number}.src").write_bytes(content)
        try:
            program = load_program(tmp_path / f"c{number}.src", ROBOT)
        except InputError as error:
            assert "\n" not in str(error)
            continue
        program.save(tmp_path / f"d{number}.src")
        assert (tmp_path / f"d{number}.src").read_bytes() == content


def test_the_payload_is_that_of_the_program(tmp_path):
    program = read(tmp_path, LOADS, DAT, ROBOT)
    assert [payload and payload.mass_kg for payload in program.tree.payloads()] == [4.5, 9.0, 4.5]
    assert program.tree.payloads()[0].com_m == (0.0, 0.0, 0.08)
    lighter = simulate(program, load_robot("kuka_kr16_r2010_2"))
    assert lighter.energy_j == pytest.approx(simulate(program, ROBOT).energy_j)  # what is given counts no more
    assert_plan_holds(program, ROBOT, tmp_path / "new.src")


def test_a_payload_is_given_beside_by_its_number(tmp_path):
    body = f"BAS(#TOOL,2)\nPTP {HOME}\nPTP {TO}\nPTP {HOME}"
    program = read(tmp_path, body, robot=ROBOT, beside=Beside(payloads={"2": Payload(6.0)}))
    assert [payload.mass_kg for payload in program.tree.payloads()] == [6.0, 6.0]


def test_a_motion_that_runs_several_times_has_one_speed(tmp_path):
    body = f"INT I\nPTP {HOME}\nFOR I=1 TO 3\nPTP {TO}\nPTP {HOME}\nENDFOR"
    plan, _ = assert_plan_holds(read(tmp_path, body), ROBOT, tmp_path / "new.src")
    speeds = [move.speed_limit_percent for move in plan.moves]
    assert speeds == speeds[:2] * 3 and max(speeds) < 100.0


def test_blended_motions_are_planned(tmp_path):
    body = f"BAS(#INITMOV,0)\n$APO.CDIS=50\nPTP {HOME}\nPTP {TO} C_DIS\nPTP {{A1 -20}} C_DIS\nPTP {HOME}"
    plan, _ = assert_plan_holds(read(tmp_path, body), ROBOT, tmp_path / "new.src")
    assert plan.saving_percent > 1.0
    shares = body.replace("$APO.CDIS=50", "$APO.CPTP=60").replace("C_DIS", "C_PTP")
    program = read(tmp_path, shares)
    assert [getattr(move.zone, "path_share", 0) for move in program.moves] == [0.3, 0.3, 0]
    assert_plan_holds(program, ROBOT, tmp_path / "new.src")


def test_a_plain_motion_behind_a_fold_does_not_keep_its_data(tmp_path):
    dat = DAT.replace("PPDAT1={VEL 60.0", "PPDAT1={VEL 90.0")
    body = inline("HOME") + inline("P1", 90, data="PPDAT1") + "PTP {A1 5}\nPTP XHOME\n"
    plan, _ = assert_plan_holds(read(tmp_path, body, dat), ROBOT, tmp_path / "new.src")
    assert f"PPDAT1={{VEL {plan.moves[0].speed_limit_percent:.1f},ACC" in (tmp_path / "new.dat").read_text()


def test_positions_that_live_in_the_controller_are_given_beside(tmp_path):
    data = tmp_path / "controller.yaml"
    data.write_text("format: robojoule-controller-data\nversion: 1\npositions_deg: {xstand: [10, -80, 80, 0, 20, 0]}\n")
    source = tmp_path / "job.src"
    source.write_text("DEF job()\nPTP XSTAND\nPTP {A1 30}\nPTP XSTAND\nEND\n")
    with pytest.raises(InputError, match="XSTAND is not in the program's files"):
        load_program(source).for_robot(ROBOT)
    program = load_program(source, beside=read_controller_data(data)).for_robot(ROBOT)
    found = np.degrees(program.tree.configurations_rad()).round(9).tolist()
    assert found == [[10, -80, 80, 0, 20, 0], [30, -80, 80, 0, 20, 0], [10, -80, 80, 0, 20, 0]]


def test_what_the_program_cannot_say_is_not_written(tmp_path):
    program = read(tmp_path, f"BAS(#INITMOV,0)\n$VEL.CP=0.5\nPTP {HOME}\nPTP {TO}\nLIN_REL {{Z -50}}", robot=ROBOT)
    tree, (first, second) = program.tree, (move.name for move in program.moves)
    elsewhere = tree.with_settings({first: {"target_rad": (0.1,) * 6}})
    for changed, message in (
        (elsewhere, "differs from the program 'cycle' in more than speeds and added waits"),
        (tree.with_plan({}, waits_after_s={first: 1.0}), "in more than speeds and added waits"),
        (tree.with_plan({second: 1.0}), "the speed of move 'move-2' cannot be written"),
    ):
        with pytest.raises(InputError, match=message):
            replace(program, tree=changed).save(tmp_path / "new.src")
        replace(program, tree=changed).save(tmp_path / "new.yaml")
    assert not (tmp_path / "new.src").exists()


def test_what_lets_the_robot_stand_is_a_wait_of_given_length(tmp_path):
    body = f"PTP {HOME}\nPTP {TO}\nGRIPPER(1)\nPTP {{A1 0}}\nIF $IN[1] THEN\nGO_AWAY()\nENDIF\nPTP {HOME}\n"
    body += f"LIN @@@\nPTP {TO}"
    program = read(tmp_path, body, beside=Beside(waits_s={4: 0.6, 6: 0.0}))
    assert np.allclose(in_degrees(program), [AT_HOME, AT, [0, *AT[1:]], AT_HOME])
    assert [one.duration_s for one in program.tree.atomic() if isinstance(one, WaitOperation)] == [0.6]
    assert any("GRIPPER() is not in this file" in note and "--wait" in note for note in read(tmp_path, body).notes)
    with pytest.raises(InputError, match=r"line 10: there is no wait of unknown length .*; allowed: lines: 4, 6"):
        read(tmp_path, body, beside=Beside(waits_s={10: 0.6}))  # it is a motion


def test_programs_that_move_nothing_are_named_beside(tmp_path):
    body = f"PTP {HOME}\nPTP {TO}\nGrip_Open()\nIF $IN[1] THEN\ngrip_open()\nENDIF\nPTP {HOME}"
    program = read(tmp_path, body, beside=Beside(still=frozenset(["GRIP_OPEN"])))
    assert np.allclose(in_degrees(program), [AT_HOME, AT, AT_HOME])
    assert not unknown_operations(program.tree)


def test_a_wait_of_a_section_stays_in_it(tmp_path):
    to, other = "PTP {A1 50,A2 -70}", "SPTP {A1 0} WITH $VEL_AXIS[1]=SVEL_JOINT(1.0)"
    path = write(tmp_path, f"PTP {HOME}\n{to}\nWAIT FOR $IN[1]\n{other}\n")
    program = load_program(path)
    first, second = program.moves
    tree = program.tree.with_plan({}, added_waits_before_s={second.name: 0.5}, added_waits_after_s={first.name: 0.2})
    replace(program, tree=tree).save(tmp_path / "planned.src")
    lines = (tmp_path / "planned.src").read_text().splitlines()
    at = lines.index("WAIT FOR $IN[1]")
    assert lines[at - 1].startswith("WAIT SEC 0.2") and lines[at + 1].startswith("WAIT SEC 0.5")
    again = load_program(tmp_path / "planned.src")
    assert [(move.added_wait_before_s, move.added_wait_after_s) for move in again.moves] == [(0.0, 0.2), (0.5, 0.0)]
    replace(again, tree=program.tree).save(tmp_path / "back.src")
    assert (tmp_path / "back.src").read_bytes() == path.read_bytes()


def test_no_wait_stops_the_robot_where_it_passes(tmp_path):
    program = read(tmp_path, f"PTP {HOME} C_PTP\nPTP {{A1 50}}\nPTP {{A1 20}}\n")
    first = program.moves[0]
    placed = program.placed(program.tree.with_plan({}, added_waits_before_s={first.name: 0.5}))
    assert [(move.added_wait_before_s, move.added_wait_after_s) for move in placed.moves()] == [(0.0, 0.5), (0.0, 0.0)]


def test_programs_of_other_files_keep_the_speed_that_was_set(tmp_path):
    program = read(tmp_path, f"BAS(#VEL_PTP,90)\nPTP {HOME}\nPTP {{A1 50}}\nELSEWHERE( )\n")
    (move,) = program.moves
    replace(program, tree=program.tree.with_plan({move.name: 40.0})).save(tmp_path / "planned.src")
    lines = (tmp_path / "planned.src").read_text().splitlines()
    at = lines.index("PTP {A1 50}")
    assert lines[at - 1 : at + 3] == ["BAS(#VEL_PTP,40)", "PTP {A1 50}", "BAS(#VEL_PTP,90)", "ELSEWHERE( )"]


def test_the_counter_of_a_loop_is_not_known_behind_it(tmp_path):
    loop = "FOR I=1 TO 2\nPTP_REL {A1 5}\nENDFOR\nIF I==2 THEN\nPTP {A1 0}\nENDIF\n"
    program = read(tmp_path, f"PTP {HOME}\n{loop}PTP {HOME}\n")
    assert any("whether this runs is not known" in note for note in program.notes)


def test_a_program_of_which_nothing_can_be_planned_says_why(tmp_path):
    body = "PTP {X 1200,Y 0,Z 900,A 0,B 90,C 0,S 2,T 2}\n"
    program = read(tmp_path, f"PTP {HOME}\n$TOOL=TOOL_DATA[4]\n{body}")
    with pytest.raises(InputError, match=r"TOOL_DATA\[4\] and the base are not in the file: give them by --tool"):
        optimize(program, ROBOT, cycle_time="+10%")


def test_a_zone_of_unknown_reach_is_told(tmp_path):
    program = read(tmp_path, f"PTP {HOME}\nPTP {TO} C_PTP\nPTP {HOME}\n")
    assert any("does not say how far its zone reaches" in note for note in program.notes)
    known = read(tmp_path, f"$APO.CPTP=30\nPTP {HOME}\nPTP {TO} C_PTP\nPTP {HOME}\n")
    assert not any("zone" in note for note in known.notes)


@pytest.mark.parametrize("block", ["WHILE NOT $IN[1]\nENDWHILE", "IF $IN[1] THEN\nWAIT SEC 1\nENDIF"])
def test_what_waits_for_a_signal_in_a_block_has_no_length(tmp_path, block):
    program = read(tmp_path, f"PTP {HOME}\nPTP {TO}\n{block}\nPTP {HOME}")
    assert len(unknown_operations(program.tree)) == 1
    known = read(tmp_path, f"PTP {HOME}\nPTP {TO}\n{block}\nPTP {HOME}", beside=Beside(waits_s={4: 0.5}))
    assert not unknown_operations(known.tree)


def test_the_reason_that_tells_most_is_named(tmp_path):
    with pytest.raises(InputError, match="XP1 is not in the program's files"):
        read(tmp_path, f"PTP {HOME}\nPTP XP1 C_PTP\nPTP XP2\n").check(ROBOT)


def test_a_linear_motion_without_a_speed_takes_a_duration_given_beside(tmp_path):
    body = f"PTP {HOME}\nPTP {TO}\nLIN_REL {{X 0,Y 0,Z -50}}\nPTP {HOME}"
    frames = {"tool": Placement.of((0.0, 0.0, 0.1), (0.0, 0.0, 0.0)), "base": Placement.of((0.0,) * 3, (0.0,) * 3)}
    program = read(tmp_path, body, robot=ROBOT, beside=Beside(**frames))
    assert any("line 4" in note and "how fast the linear motion is" in note for note in program.notes)
    assert unknown_operations(program.tree)
    program = read(tmp_path, body, robot=ROBOT, beside=Beside(**frames, waits_s={4: 0.8}))
    assert not unknown_operations(program.tree)
    assert simulate(program, ROBOT).durations_s[1] == pytest.approx(0.8, abs=2e-3)
