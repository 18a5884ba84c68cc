"""`robojoule convert`: from format to format, and what is lost on the way."""

import json

import numpy as np
import pytest

from robojoule.api import simulate
from robojoule.cli import main
from robojoule.formats.program import load_program
from robojoule.formats.registry import FORMATS
from robojoule.formats.tree_files import save_tree
from robojoule.programs.operation_tree import OperationTree, tree_from_configurations
from robojoule.programs.tree_check import in_model_angles
from robojoule.robots import load_robot

POINTS = {
    "kuka_kr16_r2010_2": [[0, -90, 90, 0, 0, 0], [50, -70, 80, 0, 30, 0], [-20.5, -60, 100, 40, 0, 0.123]],
    "ur_ur10e": [[-90, -90, -90, -90, 90, 0], [-60, -80, -100, -70, 80, 10], [-30, -70.25, -110, -60, 70, 200]],
    "fanuc_m10_12_14d": [[0, 0, 0, 0, -30, 0], [40, 20, 10, 0, -60, 0], [-20, 10, -5, 30, -45, 5]],
}
VENDOR = [suffix for one in FORMATS if getattr(one, "compose", None) is not None for suffix in one.suffixes[:1]]


def program(folder, robot):
    points = [*POINTS[robot], POINTS[robot][0]]
    tree = tree_from_configurations("cycle", np.radians(points), robot, move_names=["pick", "place", "home"])
    save_tree(tree.with_plan({"pick": 60.0, "place": 35.0}, waits_after_s={"pick": 0.5}), folder / "cycle.yaml")
    return folder / "cycle.yaml"


@pytest.mark.parametrize("robot", POINTS)
@pytest.mark.parametrize("suffix", VENDOR)
def test_there_and_back_are_the_same_motions(tmp_path, capsys, robot, suffix):
    source = program(tmp_path, robot)
    there, back = tmp_path / f"there{suffix}", tmp_path / "back.yaml"
    assert main(["convert", str(source), str(there), "--robot", robot]) == 0
    assert main(["convert", str(there), str(back), "--robot", robot]) == 0
    known, arm = load_program(source).tree, load_robot(robot)
    tree = load_program(there, arm).tree
    assert load_program(back).tree.configurations_rad() == pytest.approx(tree.configurations_rad(), abs=1e-9)
    assert in_model_angles(tree, arm).configurations_rad() == pytest.approx(known.configurations_rad(), abs=1e-5)
    wanted, found = (simulate(one, arm).cycle_time_s for one in (load_program(source), load_program(there)))
    assert found == pytest.approx(wanted, abs=0.02)  # FANUC's whole percents of speeds, hundredths of waits
    waits = [one.duration_s for one in tree.atomic() if one.type == "wait"]
    assert waits == [0.5]
    capsys.readouterr()


def test_what_a_format_cannot_say_is_listed(tmp_path, capsys):
    tree = OperationTree.model_validate(
        {
            "format": "robojoule-operation-tree",
            "version": 1,
            "name": "cell",
            "start_deg": [0, -90, 90, 0, 0, 0],
            "operations": [
                {"type": "move", "name": "over", "target_deg": [10, -90, 90, 0, 0, 0], "zone": {"radius_m": 0.05}},
                {"type": "move", "name": "down", "target_deg": [20, -90, 90, 0, 0, 0], "fixed": True},
                {"type": "process", "name": "weld", "duration_s": 1.0, "power_w": 500},
                {"type": "compound", "name": "back", "operations": [
                    {"type": "move", "name": "home", "target_deg": [0, -90, 90, 0, 0, 0]}]},
            ],
        }
    )  # fmt: skip
    save_tree(tree, tmp_path / "cell.yaml")
    words = [str(tmp_path / "cell.yaml"), "--robot", "kuka_kr16_r2010_2"]
    assert main(["convert", words[0], str(tmp_path / "cell.csv"), *words[1:], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["lost"] == [
        "the zone of move 'over' is left out: it stops at its target",
        "process 'weld' is a wait of the move before it",
        "group 'back' is not kept together",
    ]
    assert main(["convert", words[0], str(tmp_path / "cell.src"), *words[1:]]) == 0
    out, err = capsys.readouterr()
    assert out == f"3 moves written to {tmp_path / 'cell.src'} and {tmp_path / 'cell.dat'} (KUKA KRL)\n"
    assert "process 'weld' is a wait, without its power" in err and "that move 'down' is fixed is not said" in err
    again = load_program(tmp_path / "cell.src")
    assert again.moves[0].zone == tree.moves()[0].zone
    assert [one.duration_s for one in again.tree.atomic() if one.type == "wait"] == [1.0]


def test_the_same_format_keeps_every_byte(tmp_path, capsys):
    text = "DEF a( )\r\nptp {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0} ;Gr\xfc\xdfe\r\nPTP {A1 9}\r\nEND"
    (tmp_path / "a.src").write_bytes(text.encode("latin-1"))
    assert main(["convert", str(tmp_path / "a.src"), str(tmp_path / "b.src")]) == 0
    assert (tmp_path / "b.src").read_bytes() == text.encode("latin-1")
    capsys.readouterr()


BAD = {
    "unknown format": (["a.txt"], "--out: unknown file type '.txt'"),
    "itself": (["cycle.yaml"], "this is the program itself"),
    "no robot for URScript": (["a.script"], "speeds of URScript are in rad/s"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_sentence_and_writes_nothing(tmp_path, capsys, name):
    source = tmp_path / "cycle.yaml"
    save_tree(tree_from_configurations("cycle", np.radians(POINTS["ur_ur10e"])), source)
    source.write_text(source.read_text() + "angles: pendant\n")
    words, message = BAD[name]
    before = sorted(tmp_path.iterdir())
    assert main(["convert", str(source), str(tmp_path / words[0])]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before


def test_a_file_that_would_go_with_the_new_one_is_kept(tmp_path, capsys):
    source = program(tmp_path, "kuka_kr16_r2010_2")
    (tmp_path / "keep.DAT").write_text("mine")
    words = ["convert", str(source), str(tmp_path / "keep.src"), "--robot", "kuka_kr16_r2010_2"]
    assert main(words) == 2
    error = capsys.readouterr().err
    assert "keep.DAT, --out: this file would go with 'keep.src', and is there already" in error
    assert (tmp_path / "keep.DAT").read_text() == "mine" and not (tmp_path / "keep.src").exists()


def test_all_files_of_a_program_are_listed_and_replaced_together(tmp_path, capsys):
    source = program(tmp_path, "kuka_kr16_r2010_2")
    files = [str(tmp_path / "new.src"), str(tmp_path / "new.dat")]
    for _ in range(2):
        assert main(["convert", str(source), files[0], "--robot", "kuka_kr16_r2010_2", "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["files"] == files


def test_a_program_without_data_does_not_take_those_of_another_one(tmp_path, capsys):
    (tmp_path / "a.src").write_text("DEF a( )\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\nPTP {A1 9}\nEND\n")
    for name in ("b.src", "b.dat"):
        (tmp_path / name).write_text("mine")
    assert main(["convert", str(tmp_path / "a.src"), str(tmp_path / "b.src")]) == 2
    assert "b.dat: this file would go with 'b.src'" in capsys.readouterr().err
    assert [(tmp_path / name).read_text() for name in ("b.src", "b.dat")] == ["mine", "mine"]


@pytest.mark.parametrize("words", [["convert", "DATA"], ["optimize", "--cycle-time", "+10%", "--out", "DATA"]])
def test_the_controllers_data_are_not_written_over(tmp_path, capsys, words):
    (tmp_path / "a.src").write_text("DEF a( )\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\nPTP {A1 9}\nEND\n")
    data = tmp_path / "ctrl.yaml"
    data.write_text("format: robojoule-controller-data\nversion: 1\n")
    before = data.read_text()
    said = [words[0], str(tmp_path / "a.src"), *(str(data) if word == "DATA" else word for word in words[1:])]
    assert main([*said, "--controller-data", str(data), "--robot", "kuka_kr16_r2010_2"]) == 2
    assert "this is the controller data itself" in capsys.readouterr().err and data.read_text() == before


NAMES = {
    "while.src": ("DEF while_2( )", "'while' cannot be its name"),
    "Bas.src": ("DEF Bas_2( )", "the program is called Bas_2"),
    "my-part.src": ("DEF my_part( )", "the program is called my_part"),
    "con.ls": ("/PROG  CON_2", "the program is called con_2"),
}


@pytest.mark.parametrize("name", NAMES)
def test_a_program_has_a_name_that_its_language_allows(tmp_path, capsys, name):
    head, said = NAMES[name]
    robot = "fanuc_m10_12_14d" if name.endswith(".ls") else "kuka_kr16_r2010_2"
    assert main(["convert", str(program(tmp_path, robot)), str(tmp_path / name), "--robot", robot]) == 0
    assert said in capsys.readouterr().err and head in (tmp_path / name).read_text()
    assert len(load_program(tmp_path / name).moves) == 3
