"""A teach pendant program as body shops have them, self-made: 21 joint moves to places of the tool, 17 of them CNT100,
with blocks of their own below motions, payloads, a tool of the controller and a program beside it."""

import numpy as np
import pytest

from robojoule.api import optimize, simulate
from robojoule.checks import model_program
from robojoule.formats.program import load_program
from robojoule.formats.vendor.trace import Beside
from robojoule.robots import load_robot
from robojoule.robots.arm_configuration import FanucConfiguration
from robojoule.robots.inverse_kinematics import flange_placement, inverse_of
from robojoule.robots.pendant import PendantAngles
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload
from robojoule.robots.vendor_frames import vendor_base, vendor_flange
from tests.formats.vendor.fanuc_text import listing, place, written

ROBOT = "fanuc_r2000ic_165f"
GUN = Placement.of((0.12, 0.0, 0.55), (0.0, np.radians(-30.0), 0.0))
BESIDE = Beside(tools={"2": GUN}, payloads={"2": Payload(90.0)})
STOPS = {1, 8, 15, 21}
BLOCK = "      1:  TC_ONLINE (ON) ;\n      2:  DO[80]=ON ;\n      3:  !Interlock ;\n       ------ ;\n"


def joints_deg() -> np.ndarray:
    """Pendant angles of a round through a cell, shape (21, 6). [deg]"""
    share = np.linspace(0.0, 2.0 * np.pi, 21)
    base = np.array([0.0, -10.0, -20.0, 0.0, -60.0, 30.0])
    amplitude = np.array([70.0, 25.0, 15.0, 60.0, 25.0, 110.0])
    phase = np.array([0.0, 0.7, 1.9, 2.6, 0.4, 1.2])
    return base + amplitude * np.sin(share[:, None] + phase)


def figures(robot, pendant_deg) -> tuple[list[float], str]:
    """X, Y, Z [mm], W, P, R [deg] and CONFIG of the gun's tip in FANUC's world frame."""
    q = PendantAngles.of(robot).model_rad(np.radians(pendant_deg))
    tip = inverse_of(vendor_base(robot)) @ flange_placement(robot, q) @ vendor_flange(robot) @ GUN
    r = tip.rotation
    w, p = np.arctan2(r[2, 1], r[2, 2]), np.arctan2(-r[2, 0], np.hypot(r[0, 0], r[1, 0]))
    turns = np.degrees([w, p, np.arctan2(r[1, 0], r[0, 0])])
    return [*(1e3 * tip.origin_m), *turns], str(FanucConfiguration.of(robot, q))


@pytest.fixture(scope="module")
def body_shop(tmp_path_factory):
    robot = load_robot(ROBOT, payload_kg=90)
    folder = tmp_path_factory.mktemp("body-shop")
    written(folder, listing(["DO[5]=ON", "WAIT    .20(sec)", "DO[5]=OFF"], {}), "gun_on.ls")
    body = ["UFRAME_NUM=0", "UTOOL_NUM=2", "PAYLOAD[2]", "!Round of the cell"]
    for number in range(1, 22):
        ending = "CNT0" if number in STOPS else "CNT100"
        more = " TB    .10sec,P-SPS" if number % 5 == 1 else ""
        body.append(f"J P[{number}] {100 if number % 3 else 80}% {ending} ACC100{more}")
        if number in STOPS:
            body.append("CALL GUN_ON")
    positions = ""
    for number, degrees in enumerate(joints_deg(), start=1):
        xyzwpr, config = figures(robot, degrees)
        positions += place(number, xyzwpr, config, ut="2")
    text = listing(body, positions, name="UP222").replace("P-SPS ;\n", f"P-SPS ;\n{BLOCK}")
    return robot, written(folder, text.replace("\n", "\r\n"), "up222.ls")


def test_places_of_the_gun_become_the_joint_angles_that_they_were_made_of(body_shop):
    robot, path = body_shop
    program = load_program(path, robot, beside=BESIDE)
    assert program.name == "UP222" and len(program.moves) == 20
    q = PendantAngles.of(robot).model_rad(np.radians(joints_deg()))
    found = model_program(program, robot).tree.configurations_rad()
    np.testing.assert_allclose(found, q, atol=5e-5)  # 0.001 mm and 0.001 deg
    (carried,) = (one for one in program.tree.operations if one.type == "payload")
    assert carried.mass_kg == 90.0
    assert sum(not move.is_fine for move in program.moves) == 17
    assert [one.duration_s for one in program.tree.operations if one.type == "wait"] == [0.2] * 4
    path.with_name("copy.ls").unlink(missing_ok=True)
    program.save(path.with_name("copy.ls"))
    assert path.with_name("copy.ls").read_bytes() == path.read_bytes()
    assert not any("kept as it is" in note and "first" not in note for note in program.notes)


def test_the_mostly_blended_program_is_planned_and_planned_again_as_it_is(body_shop):
    robot, path = body_shop
    program = load_program(path, robot, beside=BESIDE)
    run = simulate(program, robot)
    plan = optimize(program, robot, cycle_time="+10%")
    assert plan.energy_j <= plan.energy_given_j * (1 + 1e-6)
    assert plan.saving_percent > 1.0
    assert 1.1 * run.cycle_time_s - 0.011 < plan.cycle_time_s < 1.1 * run.cycle_time_s + 1e-6  # waits are 0.01 s
    plan.save(path.with_name("plan.ls"))
    old, new = path.read_bytes().split(b"\r\n"), path.with_name("plan.ls").read_bytes().split(b"\r\n")
    if len(old) == len(new):
        assert all(a.split(b"%")[1:] == b.split(b"%")[1:] for a, b in zip(old, new, strict=True) if a != b)
    written_program = load_program(path.with_name("plan.ls"), robot, beside=BESIDE)
    assert simulate(written_program, robot).cycle_time_s <= plan.cycle_time_s + 1e-6
    again = optimize(written_program, robot, cycle_time=1.1 * run.cycle_time_s)
    assert again.program.diff() == ""
