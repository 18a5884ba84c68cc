"""RAPID programs: constructs one by one."""

import numpy as np
import pytest

from robojoule.formats.vendor.speeds import percent_for_tool_speed
from robojoule.formats.vendor.trace import (
    Beside,
    CycleStart,
    JointTarget,
    Load,
    Motion,
    PoseTarget,
    Speed,
    Unknown,
    Wait,
)
from robojoule.robots import load_robot
from robojoule.robots.arm_configuration import QuarterTurns
from robojoule.robots.inverse_kinematics import flange_placement
from robojoule.robots.rigid_body import Placement
from tests.formats.vendor.rapid_text import CYCLE, DATA, NONE, ROBOT, events, kinds, motions


def test_places_of_the_tool(tmp_path):
    body = "    MoveJ p10,v1000,z50\\Inpos:=inpos50,tGrip\\WObj:=wTable;\n    MoveJ p10,v1000,z0,tool0;"
    first, second = motions(events(tmp_path, body)[0])
    assert isinstance(first.target, PoseTarget)
    assert first.target.position_m == (0.6, 0.3, 0.5)
    np.testing.assert_allclose(first.target.rotation, np.diag([-1.0, 1.0, -1.0]), atol=1e-12)  # not normalised
    assert first.target.configuration == QuarterTurns(0, -1, 0, 1)
    np.testing.assert_allclose(first.target.tool.origin_m, [0.0, 0.0, 0.1])
    np.testing.assert_allclose(first.target.base.origin_m, [0.1, 0.0, 0.01])
    np.testing.assert_allclose(first.target.base.rotation[:, 0], [0.0, 1.0, 0.0], atol=1e-12)
    assert (first.blend.radius_m, second.blend.radius_m) == (0.05, 0.0003)  # z0 is not fine
    assert not second.target.tool.origin_m.any() and not second.target.base.origin_m.any()


def test_offsets_are_along_the_axes_that_they_name(tmp_path):
    body = "".join(
        f"    MoveJ {code},v1000,fine,tGrip;\n"
        for code in (
            "Offs(p10,10,-20,30)",
            "RelTool(p10,0,0,-50)",
            "RelTool(p10,0,0,10\\Rz:=90)",
            "Offs(CRobT(),1,2,3)",
        )
    )
    moved, drawn, turned, unknown = motions(events(tmp_path, body)[0])
    assert moved.target.position_m == pytest.approx((0.61, 0.28, 0.53))
    assert drawn.target.position_m == pytest.approx((0.6, 0.3, 0.55))  # the tool points down
    np.testing.assert_allclose(turned.target.rotation[:, 0], [0.0, 1.0, 0.0], atol=1e-12)
    assert unknown.target is None and "known only while" in unknown.reason
    assert moved.label == "Offs(p10,10,-20,30)"


def test_confj_off_names_no_configuration(tmp_path):
    body = "    ConfJ\\Off;\n    MoveJ p10,v100,fine,tGrip;\n    ConfJ\\On;\n    MoveJ p10,v100,fine,tGrip;"
    off, on = motions(events(tmp_path, body)[0])
    assert off.target.configuration is None and on.target.configuration == QuarterTurns(0, -1, 0, 1)


def test_confl_off_names_no_configuration_of_motions_along_a_path(tmp_path):
    line, circle, joint = (f"Move{form},v100,fine,tGrip;" for form in ("L p10", "C p10,p10", "J p10"))
    found, notes = events(tmp_path, "\n".join(["ConfL\\Off;", line, circle, joint, "ConfL\\On;", line]))
    line, circle, joint, again = motions(found)
    assert line.target.configuration is circle.target.configuration is circle.via.configuration is None
    assert joint.target.configuration == again.target.configuration == QuarterTurns(0, -1, 0, 1)
    assert not any("ConfL" in note for note in notes)


def test_speeds(tmp_path):
    data = f"{DATA}  CONST speeddata vOwn:=[1234,90,5000,1000];\n  VAR num nT:=1.5;\n"
    codes = [
        "v100",
        "vmax",
        "vOwn",
        "v100\\T:=2",
        "v100\\T:=nT",
        "v100\\V:=250",
        "[500,90,1,1]",
        "vLater",
        "v100\\T:=nX",
    ]
    body = "\n".join(f"    MoveAbsJ j1,{code},fine,tGrip;" for code in codes)
    found = motions(events(tmp_path, body, data=data)[0])
    speeds = [event.speed for event in found]
    assert [speed.tool_m_s for speed in speeds] == [0.1, 5.0, 1.234, None, None, 0.25, 0.5, None, None]
    assert [speed.duration_s for speed in speeds] == [None, None, None, 2.0, 1.5, None, None, None, None]
    assert [speed.writable for speed in speeds] == [True, True, True, True, False, False, True, False, False]
    assert speeds[2].tool_rad_s == pytest.approx(np.pi / 2)


def test_velset_and_accset_hold_from_there_on(tmp_path):
    body = (
        "    MoveAbsJ j1,v1000,fine,tGrip;\n    VelSet 50,300;\n    AccSet 50,100;\n    MoveAbsJ j2,v1000,fine,tGrip;"
    )
    found, notes = events(tmp_path, body)
    assert [event.speed.tool_m_s for event in motions(found)] == [1.0, 0.3]
    assert len(notes) == 2 and "VelSet" in notes[0] and "AccSet" in notes[1]


@pytest.mark.parametrize("figures", ["100,0", "0,800", "100,-5"])
def test_a_velset_that_lets_nothing_move_leaves_speeds_unknown(tmp_path, figures):
    found, notes = events(tmp_path, f"    VelSet {figures};\n    MoveAbsJ j1,v1000,fine,tGrip;")
    assert motions(found)[0].speed.tool_m_s is None and any("is not known" in note for note in notes)


def test_the_tool_speed_bounds_the_joints():
    """Axis 1 alone turns the tool on a circle: its speed is that of the joint times the radius."""
    robot = load_robot(ROBOT)
    start = np.zeros(6)
    target = np.radians([90.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    tool = Placement(np.eye(3), np.array([0.0, 0.0, 0.1]))
    radius_m = flange_placement(robot, start).origin_m[0] + 0.1
    percent = percent_for_tool_speed(robot, start, target, tool, Speed(tool_m_s=1.0))
    assert percent == pytest.approx(100.0 / radius_m / robot.velocity_rad_s[0], rel=1e-3)
    turning = percent_for_tool_speed(robot, start, target, tool, Speed(tool_m_s=50.0, tool_rad_s=0.5))
    assert turning == pytest.approx(50.0 / robot.velocity_rad_s[0], rel=1e-6)
    assert percent_for_tool_speed(robot, start, target, tool, Speed(tool_m_s=100.0)) == 100.0
    assert percent_for_tool_speed(robot, start, start, tool, Speed(tool_m_s=0.1)) == 100.0


def test_zones(tmp_path):
    data = f"{DATA}  CONST zonedata zOwn:=[FALSE,7,10,10,1,10,1];\n  CONST zonedata zStop:=[TRUE,7,10,10,1,10,1];\n"
    codes = ["fine", "z0", "z10", "zOwn", "zStop", "fine\\Inpos:=inpos20", "z200\\Z:=33"]
    body = "\n".join(f"    MoveAbsJ j1,v100,{code},tGrip;" for code in codes)
    blends = [event.blend for event in motions(events(tmp_path, body, data=data)[0])]
    assert [None if blend is None else blend.radius_m for blend in blends] == [
        None,
        0.0003,
        0.01,
        0.007,
        None,
        None,
        0.033,
    ]


def test_waits(tmp_path):
    body = "    WaitTime 0.5;\n    WaitTime\\InPos,1;\n    WaitDI di1,1;\n    WaitUntil di1=1\\MaxTime:=3;\n    Stop;"
    found, _ = events(tmp_path, body)
    assert [event.duration_s for event in found if isinstance(event, Wait)] == [0.5, 1.0, None, None, None]


def test_further_axes_in_their_own_units(tmp_path):
    data = f"{DATA}  CONST jointtarget jx:=[[0,0,0,0,0,0],[1500.5,9E9,30,9E9,9E9,9E9]];\n"
    (found,) = motions(events(tmp_path, "    MoveAbsJ jx,v100,fine,tGrip;", data=data)[0])
    assert isinstance(found.target, JointTarget) and dict(found.target.external) == {"eax_a": 1500.5, "eax_c": 30.0}


def test_components_change_and_stay_known(tmp_path):
    body = """\
    VAR jointtarget j:=jHome;
    VAR robtarget p;
    j := j1;
    j.robax.rax_4 := j.robax.rax_4 + 27;
    MoveAbsJ j,v100,fine,tGrip;
    p := p10;
    p.trans.z := 2*p.trans.z-100;
    p.trans := p.trans + [1,2,3];
    MoveJ p,v100,fine,tGrip;
    j := CJointT();
    j.robax.rax_1 := 3;
    MoveAbsJ j,v100,fine,tGrip;"""
    first, second, third = motions(events(tmp_path, body)[0])
    assert np.degrees(first.target.angles_rad).round(6).tolist() == [60, 20, 10, 27, 40, 0]
    assert second.target.position_m == pytest.approx((0.601, 0.302, 0.903))
    assert third.target is None


def test_payloads_of_tools_and_grips(tmp_path):
    data = f"{DATA}  PERS loaddata lPart:=[3,[0,0,150],[1,0,0,0],0,0,0];\n"
    body = f"{CYCLE}\n    GripLoad lPart;\n    MoveAbsJ j1,v100,fine,tGrip;\n    GripLoad load0;"
    loads = [event for event in events(tmp_path, body, data=data)[0] if isinstance(event, Load)]
    assert [load.payload.mass_kg for load in loads] == [5.0, 8.0, 5.0]
    assert loads[1].payload.com_m[2] == pytest.approx(
        (5 * 0.05 + 3 * (0.1 + 0.15)) / 8
    )  # a part's is in the tool's frame


def test_arrays_and_loops(tmp_path):
    data = f"{DATA}  CONST jointtarget js{{2}}:=[[[1,0,0,0,0,0],{NONE}],[[2,0,0,0,0,0],{NONE}]];\n"
    body = """\
    FOR i FROM 1 TO 2 DO
      MoveAbsJ js{i},v100,fine,tGrip;
    ENDFOR
    FOR i FROM 2 TO 1 DO MoveAbsJ js{i},v100,fine,tGrip; ENDFOR
    FOR i FROM 1 TO 10 STEP 9 DO
      MoveAbsJ j1,v100,fine,tGrip;
    ENDFOR
    FOR i FROM 1 TO nParts DO
      MoveAbsJ j1,v100,fine,tGrip;
    ENDFOR"""
    found, _ = events(tmp_path, body, data=data)
    firsts = [round(np.degrees(event.target.angles_rad[0])) for event in motions(found)]
    assert firsts == [1, 2, 2, 1, 60, 60] and kinds(found)[-1] is Unknown


def test_procedures_of_the_file_run_and_others_may_move_the_robot(tmp_path):
    more = """\
  LOCAL PROC go(jointtarget j,\\switch fast|switch slow,\\num count)
    MoveAbsJ j,v100,fine,tGrip;
  ERROR
    MoveAbsJ jHome,v100,fine,tGrip;
    RETRY;
  ENDPROC
  FUNC num twice(num x)
    RETURN 2*x;
  ENDFUNC
  TRAP t1
    MoveAbsJ jHome,v100,fine,tGrip;
  ENDTRAP
  PROC again()
    again;
  ENDPROC
"""
    body = '    go j1\\fast;\n    %"GO"% j2;\n    elsewhere;\n    %sName%;\n    RETURN;\n    go j1;'
    found, _ = events(tmp_path, body, more=more)
    assert kinds(found) == [Motion, Motion, Unknown, Unknown]
    assert kinds(events(tmp_path, "    again;", more=more)[0]) == [Unknown]
    assert kinds(events(tmp_path, "    elsewhere 1;", Beside(still=frozenset(["ELSEWHERE"])))[0]) == []


def test_conditions(tmp_path):
    move = "MoveAbsJ j1,v100,fine,tGrip;"
    assert kinds(events(tmp_path, f"    IF TRUE AND NOT FALSE THEN\n{move}\n    ELSE\n{move}{move}\n    ENDIF")[0]) == [
        Motion
    ]
    assert (
        kinds(events(tmp_path, f"    IF 1>2 THEN\n{move}\n    ELSEIF 2>=2 THEN\n{move}{move}\n    ENDIF")[0])
        == [Motion] * 2
    )
    assert kinds(events(tmp_path, f"    IF di1=1 THEN\n{move}\n    ENDIF")[0]) == [Unknown]
    found, notes = events(tmp_path, "    IF di1=1 THEN\n SetDO do1,1;\n    ENDIF\n    IF di1=1 Set do2;")
    assert kinds(found) == [] and len(notes) == 2
    assert kinds(events(tmp_path, f"    IF di1=1 {move}")[0]) == [Unknown]
    assert kinds(events(tmp_path, f"    IF 3=3 {move}")[0]) == [Motion]
    test = f"    TEST 2\n    CASE 1,3:\n{move}\n    CASE 2:\n{move}{move}\n    DEFAULT:\n    ENDTEST"
    assert kinds(events(tmp_path, test)[0]) == [Motion] * 2
    assert kinds(events(tmp_path, test.replace("TEST 2", "TEST nKind"))[0]) == [Unknown]


def test_a_loop_without_end_is_the_cycle(tmp_path):
    body = f"    MoveAbsJ jHome,v100,fine,tGrip;\n    WHILE TRUE DO\n{CYCLE}\n    ENDWHILE\n    elsewhere;"
    assert kinds(events(tmp_path, body)[0]) == [Motion, CycleStart, Motion, Motion, Motion, Wait, Motion]
    counting = "    VAR num n:=0;\n    WHILE n<3 DO\n    MoveAbsJ j1,v100,fine,tGrip;\n    Incr n;\n    ENDWHILE"
    assert kinds(events(tmp_path, counting)[0]) == [Motion] * 3
    assert kinds(events(tmp_path, "    WHILE di1=0 DO\n    MoveAbsJ j1,v100,fine,tGrip;\n    ENDWHILE")[0]) == [Unknown]


def test_path_and_process_motions(tmp_path):
    body = """\
    MoveL p10,v100,fine,tGrip\\WObj:=wTable;
    MoveC p10,p10,v100,z1,tGrip;
    TriggL p10,v100,trig1\\T2:=trig2,z10,tGrip;
    ArcL p10,v100,seam1,weld1\\Weave:=w1,z1,tGrip;
    SpotL p10,v100,spot1,gun1,tGrip;
    MoveLDO p10,v100,z10,tGrip,do1,1;
    SearchL di1,p10,p10,v100,tGrip;"""
    found, _ = events(tmp_path, body)
    assert [event.kind for event in motions(found)] == ["linear", "circular", "linear", "linear", "linear", "linear"]
    assert all(isinstance(event.target, PoseTarget) and not event.speed.writable for event in motions(found))
    assert isinstance(motions(found)[1].via, PoseTarget) and kinds(found)[-1] is Unknown
    assert [event.blend.radius_m if event.blend else None for event in motions(found)] == [
        None,
        0.001,
        0.01,
        0.001,
        None,
        0.01,
    ]


def test_motions_that_run_beside_others_keep_their_speed(tmp_path):
    found = motions(
        events(tmp_path, "    MoveAbsJ j1\\ID:=10,v100,z10,tGrip;\n    MoveAbsJ \\Conc,j1,v100,fine,tGrip;")[0]
    )
    assert [event.speed.writable for event in found] == [False, False]


def test_tools_and_work_objects_that_are_not_in_the_file(tmp_path):
    body = "    MoveJ p10,v100,fine,tOther\\WObj:=wOther;\n    MoveAbsJ j1,v100,fine,tOther;"
    found, notes = events(tmp_path, body)
    assert motions(found)[0].target.unknown == "tOther and wOther" and any("flange" in note for note in notes)
    beside = Beside(tools={"tOther": Placement.identity()}, bases={"wOther": Placement.identity()})
    found, _ = events(tmp_path, body, beside)
    assert motions(found)[0].target.unknown == "" and motions(found)[1].tool is not None


def test_what_is_not_understood_may_move_the_robot(tmp_path):
    found, _ = events(tmp_path, f"{CYCLE}\n    MoveAbsJ [[1,2,,v100;\n    MoveAbsJ j1,v100,fine,tGrip;")
    assert kinds(found)[-2:] == [Unknown, Motion]
    assert kinds(events(tmp_path, "    MoveAbsJ j1,v100,fine,tGrip;\n    GOTO there;\n    elsewhere;")[0]) == [
        Motion,
        Unknown,
    ]


def test_comments_and_texts_are_no_statements(tmp_path):
    body = '    ! MoveAbsJ j1,v100,fine,tGrip;\n    TPWrite "a; MoveAbsJ j1 ! "" ";  ! b; c\n'
    body += "    MoveAbsJ j1, ! x;\n v100,fine,tGrip;"
    assert kinds(events(tmp_path, body)[0]) == [Motion]


@pytest.mark.parametrize(
    "code",
    [
        "WHILE DInput(di1)=0 DO\n WaitTime 0.1;\n ENDWHILE",
        "IF di1=1 THEN\n WaitTime 1;\n ENDIF",
        "IF di1=1 WaitTime 1;",
    ],
)
def test_what_waits_for_a_signal_in_a_block_has_no_length(tmp_path, code):
    found = [event for event in events(tmp_path, f"    {code}\n")[0] if isinstance(event, (Wait, Unknown))]
    assert [type(event) for event in found] == [Wait] and found[0].duration_s is None


def test_the_tool_without_a_load_leaves_the_payload_that_is_given(tmp_path):
    body = "    MoveAbsJ jHome,v1000,fine,tool0;\n"
    assert not any(isinstance(event, Load) for event in events(tmp_path, body)[0])
    found, _ = events(tmp_path, "    MoveAbsJ jHome,v1000,fine,tGrip;\n" + body)
    assert [event.payload.mass_kg for event in found if isinstance(event, Load)][-1] == pytest.approx(0.001)
