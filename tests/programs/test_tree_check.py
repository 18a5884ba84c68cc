"""Trees in angles of the pendant: checked, computed and written back as they are."""

import json

import numpy as np
import pytest

import robojoule as rj
from robojoule.cli import main
from robojoule.errors import InputError
from robojoule.planning.batch import TreeBatch
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.programs.tree_check import check_tree, in_model_angles, robot_warnings

FANUC = "fanuc_r2000ic_165f"
ROBOT = rj.load_robot(FANUC, payload_kg=100)
PENDANT = np.radians([[0, 0, 0, 0, 0, 0], [10, 60, -10, 0, 0, 0], [0, 0, 0, 0, 0, 0]])
MODEL = np.radians([[0, 0, 0, 0, 0, 0], [10, 60, 50, 0, 0, 0], [0, 0, 0, 0, 0, 0]])


def program(configurations, angles=None):
    found = rj.Program(tree_from_configurations("lean", configurations))
    return found if angles is None else found.counted_as(angles)


def test_the_same_pose_gives_the_same_plan_in_either_angles():
    plans = [
        rj.optimize(one, ROBOT, cycle_time="+10%") for one in (program(PENDANT, "pendant"), program(MODEL, "model"))
    ]
    for key in ("energy_j", "cycle_time_s", "saving_percent", "peak_torque_ratio"):
        assert plans[0].to_dict()[key] == pytest.approx(plans[1].to_dict()[key], rel=1e-9)
    speeds = [[move.speed_limit_percent for move in plan.moves] for plan in plans]
    assert speeds[0] == pytest.approx(speeds[1], rel=1e-9)
    assert plans[0].program.angles == "pendant"
    np.testing.assert_array_equal(plans[0].program.tree.configurations_rad(), PENDANT)
    runs = [rj.simulate(one, ROBOT).energy_j for one in (program(PENDANT, "pendant"), program(MODEL))]
    assert runs[0] == pytest.approx(runs[1], rel=1e-9)
    best = [rj.pareto(one, ROBOT).to_dict()["best_energy_j"] for one in (program(PENDANT, "pendant"), program(MODEL))]
    assert best[0] == pytest.approx(best[1], rel=1e-9)


@pytest.mark.parametrize("suffix", ["yaml", "json", "csv"])
def test_a_saved_program_says_how_it_counts(tmp_path, suffix):
    path = tmp_path / f"lean.{suffix}"
    program(PENDANT, "pendant").save(path)
    read = rj.load_program(path)
    assert read.angles == "pendant"
    np.testing.assert_array_equal(read.tree.configurations_rad(), PENDANT)
    program(MODEL).save(path)
    assert rj.load_program(path).angles == "model"
    assert "angles" not in path.read_text()


def test_the_warning_is_for_pendants_that_count_otherwise_and_programs_that_do_not_say():
    (warning,) = robot_warnings(program(PENDANT).tree, ROBOT)
    assert "the pendant of fanuc_r2000ic_165f counts J3 otherwise" in warning
    assert not robot_warnings(program(PENDANT, "model").tree, ROBOT)
    assert not robot_warnings(program(PENDANT, "pendant").tree, ROBOT)
    assert not robot_warnings(program(PENDANT).tree, rj.load_robot("kuka_kr16_r2010_2"))
    assert warning in rj.optimize(program(MODEL), ROBOT, cycle_time="+10%").warnings


def test_limits_are_checked_in_angles_of_the_model():
    """J2 = 60, J3 = 160 on the pendant is J3 = 220 against the upper arm."""
    tree = program(np.radians([[0] * 6, [0, 60, 160, 0, 0, 0]]), "pendant").tree
    with pytest.raises(InputError, match=r"J3 = .* \(220 deg\) is beyond its limit in angles of the model"):
        check_tree(tree, ROBOT)
    with pytest.raises(InputError, match="5 joint positions given"):
        check_tree(program(np.zeros((2, 5)), "pendant").tree, ROBOT)


def test_other_angles_are_refused():
    with pytest.raises(InputError, match=r"^angles: unknown angles 'teach'; allowed: model, pendant$"):
        program(MODEL).counted_as("teach")
    with pytest.raises(InputError, match="in angles of the pendant"):
        TreeBatch(ROBOT, [program(PENDANT, "pendant").tree])
    np.testing.assert_allclose(in_model_angles(program(PENDANT, "pendant").tree, ROBOT).configurations_rad(), MODEL)


def test_commands_take_angles(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    program(PENDANT).save("pendant.yaml")
    program(MODEL).save("model.yaml")
    robot = ["--robot", FANUC, "--payload", "100", "--json"]
    found = []
    for name, words in (("pendant.yaml", ["--angles", "pendant"]), ("model.yaml", ["--angles", "model"])):
        assert main(["simulate", name, *robot, *words]) == 0
        found.append(json.loads(capsys.readouterr().out))
    assert found[0]["energy_j"] == pytest.approx(found[1]["energy_j"], rel=1e-9)
    assert found[0]["warnings"] == found[1]["warnings"] == []
    ends = []
    for at, angles in (("10,60,-10,0,0,0", "pendant"), ("10,60,50,0,0,0", "model")):
        assert main(["profile", *robot, "--from", "0,0,0,0,0,0", "--to", at, "--angles", angles, "--points", "3"]) == 0
        ends.append(json.loads(capsys.readouterr().out))
    assert ends[0]["energy_j"] == pytest.approx(ends[1]["energy_j"], rel=1e-12)
    text = "q1_deg,q2_deg,angles\n0,0,up\n1,1,\n"
    (tmp_path / "a.csv").write_text(text)
    assert main(["simulate", "a.csv", *robot]) == 2
    assert "line 2, column angles: unknown angles 'up'" in capsys.readouterr().err


def test_the_robot_may_be_the_one_that_the_program_names(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rj.Program(tree_from_configurations("lean", MODEL, FANUC)).save("named.yaml")
    program(MODEL).save("any.yaml")
    assert main(["simulate", "named.yaml", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["robot"] == FANUC
    assert main(["simulate", "any.yaml"]) == 2
    assert "--robot: the program does not say which robot it is for" in capsys.readouterr().err
