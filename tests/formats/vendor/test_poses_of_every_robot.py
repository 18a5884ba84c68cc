"""Places of the tool in every vendor's way of saying them: each robot's joint angles come back out of its language.

Self-made: the places are computed by the forward kinematics, the texts by the vendors' rules for angles and frames.
"""

import math

import numpy as np
import pytest

from robojoule.checks import model_program
from robojoule.formats.program import load_program
from robojoule.formats.vendor.trace import Beside
from robojoule.robots import list_robots, load_robot
from robojoule.robots.arm_configuration import FanucConfiguration, QuarterTurns, StatusAndTurn
from robojoule.robots.inverse_kinematics import flange_placement, inverse_of
from robojoule.robots.rigid_body import Placement, quaternions
from robojoule.robots.robot import Robot
from robojoule.robots.vendor_frames import vendor_base, vendor_flange
from tests.formats.vendor.fanuc_text import listing, place

TOOL_MM_DEG = (20.0, -35.0, 140.0, 15.0, -25.0, 40.0)  # x, y, z, and turns about fixed x, y, z
BASE_MM_DEG = (300.0, 120.0, -80.0, 0.0, 0.0, 25.0)
POSES = 5


def frame(x, y, z, *turns) -> Placement:
    return Placement.of((x / 1e3, y / 1e3, z / 1e3), tuple(map(math.radians, turns)))


TOOL, BASE = frame(*TOOL_MM_DEG), frame(*BASE_MM_DEG)


def fixed_turns(place_: Placement) -> list[float]:
    """Turns about fixed x, y, z. [deg]"""
    r = place_.rotation
    x, z = math.atan2(r[2, 1], r[2, 2]), math.atan2(r[1, 0], r[0, 0])
    return [math.degrees(angle) for angle in (x, math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0])), z)]


def walk(robot: Robot, seed: int) -> np.ndarray:
    """Configurations near each other, within the limits and within half a turn of joint 1."""
    chance = np.random.default_rng(seed)
    half = np.radians([170.0, 360.0, 360.0, 340.0, 360.0, 340.0])
    lower, upper = np.maximum(robot.lower_rad, -half), np.minimum(robot.upper_rad, half)
    middle = 0.5 * (lower + upper)
    q = middle + 0.6 * (upper - middle) * chance.uniform(-1.0, 1.0, 6)
    rows = [q]
    for _ in range(POSES):
        q = np.clip(q + chance.normal(0.0, 0.25, 6), lower + 0.02, upper - 0.02)
        rows.append(q)
    return np.array(rows)


def tip(robot: Robot, q: np.ndarray) -> Placement:
    """The tool in the program's base, as the controller counts."""
    world = vendor_base(robot) @ BASE
    return inverse_of(world) @ flange_placement(robot, q) @ vendor_flange(robot) @ TOOL


def mm(place_: Placement) -> list[float]:
    return (1e3 * place_.origin_m).tolist()


def krl(robot, rows):
    def text(x, y, z, rx, ry, rz):
        return f"X {x:.6f},Y {y:.6f},Z {z:.6f},A {rz:.6f},B {ry:.6f},C {rx:.6f}"

    lines = [f"$TOOL={{{text(*TOOL_MM_DEG)}}}", f"$BASE={{{text(*BASE_MM_DEG)}}}"]
    for q in rows:
        at, said = tip(robot, q), StatusAndTurn.of(robot, q)
        lines.append(f"PTP {{E6POS: {text(*mm(at), *fixed_turns(at))},S {said.status},T {said.turn},E1 0.0}}")
    return ".src", "DEF poses( )\n" + "\n".join(lines) + "\nEND\n", Beside()


def teach_pendant(robot, rows):
    positions = ""
    for number, q in enumerate(rows, start=1):
        at = tip(robot, q)
        said = str(FanucConfiguration.of(robot, q))
        positions += place(number, [*mm(at), *fixed_turns(at)], said, uf="1", ut="2")
    body = [f"J P[{number}] 100% FINE" for number in range(1, len(rows) + 1)]
    return ".ls", listing(body, positions), Beside(tools={"2": TOOL}, bases={"1": BASE})


def rapid(robot, rows):
    def pose(one):
        turn = ",".join(f"{part:.9f}" for part in quaternions(one.rotation[..., None])[0])
        return f"[{','.join(f'{part:.6f}' for part in mm(one))}],[{turn}]"

    tool = f"  PERS tooldata t1:=[TRUE,[{pose(TOOL)}],[1,[0,0,1],[1,0,0,0],0,0,0]];"
    base = f'  PERS wobjdata w1:=[FALSE,TRUE,"",[{pose(BASE)}],[[0,0,0],[1,0,0,0]]];'
    lines = []
    for q in rows:
        said = QuarterTurns.of(robot, q)
        conf, none = f"[{said.cf1},{said.cf4},{said.cf6},{said.cfx}]", "[9E9,9E9,9E9,9E9,9E9,9E9]"
        lines.append(f"    MoveJ [{pose(tip(robot, q))},{conf},{none}],vmax,fine,t1\\WObj:=w1;")
    text = "\n".join([tool, base, "  PROC main()", *lines, "  ENDPROC"])
    return ".mod", f"MODULE poses\n{text}\nENDMODULE\n", Beside()


def ur(robot, rows):
    def pose(one):
        w, *axis = quaternions(one.rotation[..., None])[0].tolist()
        length = math.hypot(*axis)
        turn = [part * 2.0 * math.atan2(length, w) / length for part in axis]
        return "p[" + ", ".join(f"{part:.9f}" for part in (*one.origin_m, *turn)) + "]"

    first = ", ".join(f"{angle:.9f}" for angle in rows[0])
    lines = [f"  set_tcp({pose(TOOL)})", f"  movej([{first}])"]
    lines += [f"  movej(pose_trans({pose(BASE)}, {pose(tip(robot, q))}))" for q in rows[1:]]
    return ".script", "def poses():\n" + "\n".join(lines) + "\nend\n", Beside()


LANGUAGES = {"KUKA": (krl, rapid), "FANUC": (teach_pendant,), "Universal Robots": (ur,)}
TOLD_APART = [name for name in list_robots() if name != "fanuc_crx10ia"]  # one CONFIG of a CRX means several solutions


@pytest.mark.parametrize("name", TOLD_APART)
def test_joint_angles_come_back_out_of_places(tmp_path, name):
    robot = load_robot(name)
    rows = walk(robot, list_robots().index(name))
    for language in LANGUAGES[robot.vendor]:
        suffix, text, beside = language(robot, rows)
        (tmp_path / f"poses{suffix}").write_text(text)
        program = load_program(tmp_path / f"poses{suffix}", robot, beside=beside)
        found = model_program(program, robot).tree.configurations_rad()
        # 0.001 mm and 0.001 deg leave that much open where the wrist is nearly stretched.
        np.testing.assert_allclose(found, rows, atol=1e-3, err_msg=language.__name__)
