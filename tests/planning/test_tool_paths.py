"""Trees with paths of the tool: simulated, planned, refused, and joint motions where only these are known."""

import numpy as np
import pytest

import robojoule as rj
from robojoule.errors import InputError
from robojoule.formats.joint_motions import as_joint_motions
from robojoule.formats.tree_files import parse_tree
from robojoule.motion.groups import LoadedMotions
from robojoule.motion.simulation import MotionPaths
from robojoule.motion.tool_motions import ToolMotions
from robojoule.planning.batch import TreeBatch
from robojoule.planning.path_checks import collision_warnings
from robojoule.planning.tree_motions import check_single_moves
from robojoule.programs.tool_moves import tool_moves_of_tree
from tests.calibration.machines import joint_controller
from tests.core_cases import kr16

ENDS_DEG = [(0, -70, 90, 0, 50, 0), (20, -65, 90, 0, 50, 0)]
SEAM = {"type": "linear", "tool_m": [0, 0, 0.2], "acceleration_m_s2": 2}


def welding(path=SEAM, fixed=True, between=(), ends=ENDS_DEG):
    """There along a path of the tool, back as the joints like."""
    seam = {"type": "move", "name": "seam", "target_deg": ends[1], "path": path, "speed_limit_percent": 6}
    data = {
        "format": "robojoule-operation-tree",
        "version": 1,
        "name": "welding",
        "start_deg": ends[0],
        "operations": [
            seam | ({"fixed": True} if fixed else {}),
            *between,
            {"type": "move", "name": "aside", "target_deg": [60, -60, 80, 0, 40, 0]},
            {"type": "move", "name": "back", "target_deg": ends[0]},
        ],
    }
    return rj.Program(parse_tree(data, "welding"))


def test_a_cycle_is_the_sum_of_its_motions():
    robot, given = kr16(), welding()
    run = rj.simulate(given, robot)
    of_tool = ToolMotions(robot, [tool_moves_of_tree(given.tree)[0]]).simulate([0.06])
    points = given.tree.configurations_rad()
    joints = MotionPaths(robot, points[1:-1], points[2:]).simulate([1.0])
    assert run.durations_s == pytest.approx([of_tool.duration_s[0, 0], *joints.duration_s[:, 0]], rel=1e-12)
    assert run.energy_j == pytest.approx(of_tool.energy_j.sum() + joints.energy_j.sum(), rel=1e-12)
    batch = TreeBatch(robot, [given.tree])
    assert isinstance(batch.executed, LoadedMotions)
    assert run.peak_powers_w[1:] == pytest.approx(joints.peak_power_w[:, 0])


def test_moves_beside_a_path_of_the_tool_have_the_very_figures_of_a_plain_tree():
    robot = kr16()
    with_path, plain = (rj.simulate(welding(path), robot) for path in (SEAM, "joint"))
    for name in ("durations_s", "peak_powers_w", "peak_torque_ratios", "speed_limits"):
        assert np.array_equal(getattr(with_path, name)[1:], getattr(plain, name)[1:]), name


def test_payloads_change_between_motions_of_the_tool():
    grip = {"type": "payload", "name": "grip", "mass_kg": 14}
    robot, heavy = kr16(5.0), kr16(14.0)
    run = rj.simulate(welding(between=(grip,)), robot)
    assert run.vertex_energies_j[0] == pytest.approx(rj.simulate(welding(), robot).vertex_energies_j[0])
    assert run.vertex_energies_j[2] == pytest.approx(rj.simulate(welding(), heavy).vertex_energies_j[2])


@pytest.mark.parametrize("profiles", ["simulated", "predicted"])
def test_a_fixed_seam_keeps_its_speed_in_plans(profiles):
    robot, given = kr16(), welding()
    plan = rj.optimize(given, robot, cycle_time="+20%", profiles=profiles)
    seam, *_ = plan.program.moves
    assert seam.speed_limit_percent == 6
    assert seam.path == given.moves[0].path
    run = rj.simulate(given, robot)
    assert plan.cycle_time_s == pytest.approx(1.2 * run.cycle_time_s, rel=1e-3)
    assert plan.energy_j < run.energy_j + 0.2 * run.cycle_time_s * 500.0
    said = "1 motion along a path of the tool was simulated: predictors know straight motions only"
    assert (said in plan.warnings) == (profiles == "predicted")


def test_an_open_seam_is_slowed_down_like_other_moves():
    robot, given = kr16(), welding(fixed=False)
    plan = rj.optimize(given, robot, cycle_time="+50%")
    assert plan.program.moves[0].speed_limit_percent <= 6
    assert plan.gap_to_optimum_percent <= 0.1
    waiting = rj.optimize(welding(), robot, cycle_time=plan.cycle_time_s)
    assert plan.energy_j <= waiting.energy_j * (1.0 + 1e-4)


def test_a_profile_of_the_seam_alone():
    found = rj.energy_profile(kr16(), program=welding(), move="seam", points=5)
    of_tool = ToolMotions(kr16(), [tool_moves_of_tree(welding().tree)[0]])
    assert found.durations_s[-1] == pytest.approx(of_tool.durations([1.0])[0, 0])


def test_paths_that_cannot_be_followed_are_told_with_their_move():
    circle = {"type": "circular", "via_m": [1.2, 0.1, 9.0]}
    with pytest.raises(InputError, match=r"cannot follow the path of move 'seam': .*; allowed: a path within reach"):
        rj.simulate(welding(circle), kr16())


def test_what_knows_joint_motions_alone_gets_motions_of_the_same_duration():
    robot, given = kr16(), welding()
    tree, lost = as_joint_motions(given.tree, robot)
    assert lost == ("the path of move 'seam' is left out: a joint motion of the same duration takes its place",)
    assert tree.moves()[0].path == "joint"
    assert tree.moves()[1:] == given.tree.moves()[1:]
    with_path, without = rj.simulate(given, robot), rj.simulate(rj.Program(tree), robot)
    assert without.durations_s == pytest.approx(with_path.durations_s, rel=1e-6)
    assert without.energy_j != pytest.approx(with_path.energy_j, rel=1e-4)
    assert as_joint_motions(tree, robot) == (tree, ())
    unknown, said = as_joint_motions(given.tree)
    assert unknown.moves()[0].speed_limit_percent == 6
    assert "of the same speed limit" in said[0]
    with pytest.raises(InputError, match="move 'seam' has a path of the tool"):
        check_single_moves(given.tree)


def test_the_way_of_the_tool_is_looked_at_for_collisions():
    """Round the base the joints keep their distance, the straight way between the same ends does not."""
    ends = [(angle, -70, 135, 0, 50, 0) for angle in (-70, 70)]
    assert collision_warnings(welding("joint", ends=ends).tree, kr16()) == ()
    found = collision_warnings(welding("linear", ends=ends).tree, kr16())
    assert any(one.startswith("link_1 touches link_6 in move 'seam'") for one in found)


def test_what_a_learnt_timing_does_not_change_is_told():
    """It knows limits of joints: paths of the tool take its dead time and nothing else."""
    learnt = kr16().variant(controller=joint_controller(kr16(), dead_s=0.02))
    run, before = rj.simulate(welding(), learnt), rj.simulate(welding(), kr16())
    assert run.durations_s[0] == pytest.approx(before.durations_s[0] + 0.02)
    told = "paths of the tool take the dead time of the learnt timing alone"
    assert any(told in warning for warning in run.warnings)
    plan = rj.optimize(welding(), learnt, cycle_time="+20%")
    assert any(told in warning for warning in plan.warnings)
    for found in (before, rj.simulate(welding("joint"), learnt)):
        assert not any(told in warning for warning in found.warnings)
