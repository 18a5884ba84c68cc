"""A handling program as a controller of today writes it: inline forms, poses in the .dat, blends, linear motions."""

import numpy as np
import pytest

from robojoule.formats.program import load_program
from robojoule.formats.vendor.krl.geometry import fields_of
from robojoule.formats.vendor.text import lines_of
from robojoule.formats.vendor.trace import Beside
from robojoule.robots import load_robot
from robojoule.robots.arm_configuration import StatusAndTurn
from robojoule.robots.inverse_kinematics import flange_placement
from robojoule.robots.rigid_body import Placement
from tests.formats.vendor.checks import assert_plan_holds, in_degrees

ROBOT = load_robot("kuka_kr16_r2010_2", payload_kg=8)
TOOL = Placement.of((0.0, 0.0, 0.12), (0.0, 0.0, 0.5))
HOME = [0, -90, 90, 0, 0, 0]
POINTS = {
    "P1": [40, -75, 95, 10, 40, 0],
    "P2": [45, -70, 98, 12, 50, 5],
    "P3": [44.9, -66, 100, 12, 52, 5],
    "P4": [-30, -80, 100, -20, 45, 170],
    "P5": [-32, -72, 102, -20, 47, -200],  # beyond a turn of half a circle: T tells it
}


def data_list() -> str:
    lines = [
        "&ACCESS RVP",
        "DEFDAT  handling",
        "DECL E6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.0,A6 0.0,E1 0.0}",
        'DECL FDAT FHOME={TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE,POINT2[] " "}',
        "DECL PDAT PDEFAULT={VEL 100.000,ACC 100.000,APO_DIST 100.000,APO_MODE #CPTP}",
        "DECL LDAT LCPDAT1={VEL 2.00000,ACC 100.000,APO_DIST 50.000}",
    ]
    for name, degrees in POINTS.items():
        q = np.radians(degrees)
        fields = fields_of(flange_placement(ROBOT, q) @ TOOL)
        place = ",".join(f"{key} {one.value:.6f}" for key, one in fields.items())
        meant = StatusAndTurn.of(ROBOT, q)
        lines += [
            f"DECL E6POS X{name}={{{place},S {meant.status},T {meant.turn},E1 0.0,E2 0.0,E3 0.0}}",
            f'DECL FDAT F{name}={{TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE,POINT2[] " "}}',
            f"DECL PDAT PPDAT{name[1]}={{VEL 100.000,ACC 100.000,APO_DIST 60.000,APO_MODE #CDIS}}",
        ]
    return "\r\n".join([*lines, "ENDDAT", ""])


def sptp(name: str, data: str, *, blend: bool = False) -> list[str]:
    return [
        f";FOLD SPTP {name}{' CONT' if blend else ''} Vel=100 % {data} Tool[1]:grip Base[0] ;%{{PE}}",
        "  ;FOLD Parameters ;%{h}",
        f"    ;Params IlfProvider=spline; Kuka.PointName={name}; Kuka.VelocityPtp=100; IlfCommand=SPTP",
        "  ;ENDFOLD",
        f"  SPTP X{name} WITH $VEL_AXIS[1] = SVEL_JOINT(100.0), $TOOL = STOOL2(F{name}), "
        f"$BASE = SBASE(F{name}.BASE_NO), $IPO_MODE = SIPO_MODE(F{name}.IPO_FRAME), "
        f"$APO = SAPO_PTP(P{data}){' C_Spl' if blend else ''}",
        ";ENDFOLD",
    ]


def lin(name: str) -> list[str]:
    return [
        f";FOLD LIN {name} Vel=0.5 m/s CPDAT1 Tool[1]:grip Base[0] ;%{{PE}}",
        "  $BWDSTART = FALSE",
        "  LDAT_ACT = LCPDAT1",
        f"  FDAT_ACT = F{name}",
        "  BAS(#CP_PARAMS, 0.5)",
        f"  LIN X{name} ",
        ";ENDFOLD",
    ]


def source() -> str:
    lines = [
        *("&ACCESS RVP", "DEF handling( )", ";FOLD INI;%{PE}"),
        *("  GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )", "  INTERRUPT ON 3 ", "  BAS (#INITMOV,0 )"),
        *(";ENDFOLD (INI)", *sptp("HOME", "DEFAULT"), "LOOP"),
        *(*sptp("P1", "PDAT1", blend=True), *sptp("P2", "PDAT2"), *lin("P3"), "$OUT[1]=TRUE", "WAIT SEC 0.5"),
        *(*lin("P2"), *sptp("P1", "PDAT1", blend=True), *sptp("P4", "PDAT4", blend=True), *sptp("P5", "PDAT5")),
        *("$OUT[1]=FALSE", *sptp("P4", "PDAT4", blend=True), *sptp("HOME", "DEFAULT"), "ENDLOOP", "END"),
    ]
    return "\r\n".join(lines) + "\r\n"


@pytest.fixture()
def handling(tmp_path):
    (tmp_path / "handling.src").write_bytes(source().encode())
    (tmp_path / "handling.dat").write_bytes(data_list().encode())
    return load_program(tmp_path / "handling.src", ROBOT, beside=Beside(tool=TOOL))


def test_it_is_read_as_it_was_taught(handling):
    wanted = [HOME, *(POINTS[name] for name in ("P1", "P2", "P3", "P2", "P1", "P4", "P5", "P4")), HOME]
    assert np.allclose(in_degrees(handling), wanted, atol=1e-4)
    assert [not move.is_fine for move in handling.moves] == [True, False, False, False, True, True, False, True, False]
    assert [move.fixed for move in handling.moves] == [False, False, True, True, False, False, False, False, False]


def test_it_is_planned_and_written(handling, tmp_path):
    plan, _ = assert_plan_holds(handling, ROBOT, tmp_path / "new.src", cycle_time="+15%", beside=Beside(tool=TOOL))
    assert plan.saving_percent > 10.0
    for name, before in (("new.src", source()), ("new.dat", data_list())):
        after = (tmp_path / name).read_bytes().decode()
        assert after.count("\r\n") == after.count("\n")
        pairs = [(a, b) for a, b in zip(lines_of(before), lines_of(after), strict=True) if a != b]
        assert pairs and all("SPTP" in a or "VelocityPtp" in a or "PDAT" in a for a, _ in pairs)
        assert all("LIN" not in a and "LDAT" not in a for a, _ in pairs)
