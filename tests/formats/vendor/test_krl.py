"""KRL programs: read, planned, written, constructs one by one."""

import numpy as np
import pytest

from robojoule.api import optimize
from robojoule.formats.program import load_program
from robojoule.robots import load_robot

HOME = "{A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}"
FOLDED = """\
;FOLD PTP HOME Vel= 100 % DEFAULT;%{PE}%R 5.4.37,%MKUKATPBASIS,%CMOVE,%VPTP,%P 1:PTP, 2:HOME, 3:, 5:100, 7:DEFAULT
$BWDSTART=FALSE
PDAT_ACT=PDEFAULT
FDAT_ACT=FHOME
BAS(#PTP_PARAMS,100)
PTP XHOME
;ENDFOLD
"""
DAT = f"""\
DEFDAT cycle
DECL E6AXIS XHOME={HOME}
DECL PDAT PDEFAULT={{VEL 100.000,ACC 100.000,APO_DIST 100.000}}
DECL FDAT FHOME={{TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE}}
ENDDAT
"""


def read(tmp_path, body, dat=None, name="cycle"):
    text = body if "DEF " in body else f"DEF {name}( )\n{body}\nEND\n"
    (tmp_path / f"{name}.src").write_bytes(text.encode() if isinstance(text, str) else text)
    if dat is not None:
        (tmp_path / f"{name}.dat").write_text(dat)
    return load_program(tmp_path / f"{name}.src")


def degrees(program):
    return np.degrees(program.tree.configurations_rad()).round(6).tolist()


def test_aggregates_keep_the_axes_that_they_do_not_name(tmp_path):
    program = read(tmp_path, f"PTP {HOME}\nPTP {{A1 30,A3 80}}\nPTP_REL {{A4 10}}\nptp {{a6 -5.5}}")
    assert degrees(program) == [
        [0, -90, 90, 0, 0, 0],
        [30, -90, 80, 0, 0, 0],
        [30, -90, 80, 10, 0, 0],
        [30, -90, 80, 10, 0, -5.5],
    ]
    assert (program.angles, program.name, program.format) == ("pendant", "cycle", "KUKA KRL")


def test_a_plan_changes_fold_and_code_and_the_next_plan_nothing(tmp_path):
    body = f"BAS(#INITMOV,0)\n{FOLDED}PTP {{A1 50,A2 -70}}\nWAIT SEC 0.4\nBAS(#VEL_PTP,80)\nPTP {{A1 -20}}\n{FOLDED}"
    robot = load_robot("kuka_kr16_r2010_2", payload_kg=8)
    plan = optimize(read(tmp_path, body, DAT), robot, cycle_time="+20%")
    plan.save(tmp_path / "new.src")
    new = load_program(tmp_path / "new.src")
    assert [move.speed_limit_percent for move in new.moves] == [m.speed_limit_percent for m in plan.moves]
    assert (tmp_path / "new.dat").read_text() == DAT
    last = f"{plan.moves[-1].speed_limit_percent:g}"
    fold = (tmp_path / "new.src").read_text()[-len(FOLDED) - 40 :]
    assert f"Vel= {last} %" in fold and f"5:{last}," in fold and f"BAS(#PTP_PARAMS,{last})" in fold
    again = optimize(new, robot, cycle_time=plan.cycle_time_s)
    assert again.program.diff() == ""


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_program_saved_as_it_is_keeps_every_byte(tmp_path, end):
    content = f"&ACCESS RVP{end}DEF cycle( ){end}Ptp {HOME} ;Gr".encode() + b"\xfc\xdfe" + f"{end}PTP {{A1 9}}".encode()
    (tmp_path / "cycle.src").write_bytes(content)
    load_program(tmp_path / "cycle.src").save(tmp_path / "copy.src")
    assert (tmp_path / "copy.src").read_bytes() == content
