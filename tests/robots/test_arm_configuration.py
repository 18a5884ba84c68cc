"""What vendors' programs say of a solution: known postures, and the one meant is found among all solutions."""

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.robots import list_robots, load_robot
from robojoule.robots.arm_configuration import (
    Configuration,
    FanucConfiguration,
    Posture,
    QuarterTurns,
    StatusAndTurn,
    chosen,
)
from robojoule.robots.inverse_kinematics import flange_placement, joints_for_pose
from robojoule.robots.pendant import PendantAngles

KR16, LR_MATE = "kuka_kr16_r2010_2", "fanuc_lrmate200id"


def at(name, pendant_deg):
    robot = load_robot(name)
    return robot, PendantAngles.of(robot).model_rad(np.radians(pendant_deg))


@pytest.mark.parametrize(
    "pendant_deg, status, turn",
    [
        ((0, -90, 90, 0, 0, 0), 2, 2),  # XHOME of KUKA's own programs: S 2, T 2
        ((0, -90, 90, 0, 45, 0), 2, 2),
        ((-20, -90, 90, 0, 45, -10), 2, 35),  # T 35 = A1, A2 and A6 below zero, as in programs of cells
        ((10, -90, 90, -15, -30, -40), 6, 58),  # the others are self-made from the definition
        ((10, -90, -20, 0, -45, 0), 5, 22),  # wrist behind axis 1, arm bent the other way
        ((0, -160, 60, 0, 10, 0), 3, 2),
    ],
)
def test_status_and_turn(pendant_deg, status, turn):
    assert StatusAndTurn.of(*at(KR16, pendant_deg)) == StatusAndTurn(status, turn)


@pytest.mark.parametrize(
    "pendant_deg, text",
    [
        ((0, 0, 0, 0, 0, 0), "N U T, 0, 0, 0"),  # what the pendant shows at zero
        ((0, 0, 0, 0, -90, 0), "N U T, 0, 0, 0"),
        ((0, 0, 0, 0, 40, 0), "F U T, 0, 0, 0"),
        ((0, 0, 0, 185, -30, -200), "N U T, 1, 0, -1"),  # self-made from the definition
        ((0, -100, 170, 0, -90, 0), "N U B, 0, 0, 0"),
        ((0, 60, 90, 0, -90, 180), "N D T, 0, 0, 0"),
    ],
)
def test_fanuc_strings(pendant_deg, text):
    found = FanucConfiguration.of(*at(LR_MATE, pendant_deg))
    assert str(found) == text
    assert FanucConfiguration.parsed(text) == found
    assert FanucConfiguration.parsed(text.replace(" ", "")) == found


@pytest.mark.parametrize(
    "text", ["", "N U", "N U T", "N U T, 0, 0", "N U X, 0, 0, 0", "N U T, 0, 0, x", "L U T, 0, 0, 0"]
)
def test_other_strings_are_refused(text):
    with pytest.raises(InputError, match="is not a configuration; allowed: such as 'N U T, 0, 0, 0'"):
        FanucConfiguration.parsed(text)


def test_quarter_turns_on_a_fanuc_whose_axes_count_as_abb_does():
    """Self-made from the definition: -1 is -90 to 0 deg, 1 is 90 to 180 deg."""
    robot, q = at(LR_MATE, (-10, 0, 0, 100, -20, -200))
    assert QuarterTurns.of(robot, q) == QuarterTurns(-1, 1, -3, 1)


def test_the_arm_is_bent_by_nothing_where_its_wrist_is_farthest():
    """The border of KUKA's bit 1 is where axes 2, 3 and the wrist are in line: A3 = atan(150 / 860) on a KR16."""
    reach = np.degrees(np.arctan2(0.15, 0.86))
    assert abs(Posture.of(*at(KR16, (30, -50, reach, 0, 20, 0))).bend_rad) < 1e-9
    assert Posture.of(*at(KR16, (30, -50, reach + 1, 0, 20, 0))).bend_rad > 0
    assert Posture.of(*at(KR16, (30, -50, reach - 1, 0, 20, 0))).bend_rad < 0


KINDS = [(StatusAndTurn, "kuka"), (FanucConfiguration, "fanuc"), (QuarterTurns, "kuka")]


@pytest.mark.parametrize("kind, name", [(k, n) for k, vendor in KINDS for n in list_robots() if n.startswith(vendor)])
def test_the_meant_one_is_found_among_all_solutions(kind, name):
    robot = load_robot(name)
    # What a vendor's figures do not tell apart is left out: whole turns of joint 1 beyond 180 deg, and of a CRX, whose
    # wrist has an offset, several solutions of one branch.
    half = np.radians([179.0, 360.0, 360.0, 350.0, 360.0, 350.0])
    random = np.random.default_rng(8)
    for _ in range(8):
        q = random.uniform(np.maximum(robot.lower_rad, -half), np.minimum(robot.upper_rad, half))
        configuration: Configuration = kind.of(robot, q)
        assert configuration.agreement(Posture.of(robot, q)) == 2
        solutions = joints_for_pose(robot, flange_placement(robot, q), near_rad=robot.home_rad)
        found, agreement = chosen(robot, solutions, configuration)
        assert agreement == 2
        if name != "fanuc_crx10ia":
            np.testing.assert_allclose(found, q, atol=1e-6)


def test_a_turn_that_no_solution_has_leaves_the_branch():
    robot, q = at(KR16, (0, -90, 90, 0, 45, 0))
    solutions = joints_for_pose(robot, flange_placement(robot, q), near_rad=q)
    found, agreement = chosen(robot, solutions, StatusAndTurn(2, 63))
    assert agreement == 1
    np.testing.assert_allclose(found, q, atol=1e-6)
    assert chosen(robot, solutions, StatusAndTurn(5, 2))[1] < 2
    assert chosen(robot, solutions, StatusAndTurn(2))[1] == 2


def test_borders_belong_to_both_sides():
    robot, q = at(KR16, (0, -90, 90, 0, 0, 0))
    posture = Posture.of(robot, q)
    assert StatusAndTurn(2, 2).agreement(posture) == StatusAndTurn(6, 2 + 16 + 1).agreement(posture) == 2
