"""Every YAML block of the documents goes through every command that reads such a file, as it is printed."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from robojoule.cli import COMMANDS, main
from robojoule.documents import write_document
from tests.conftest import ROOT
from tests.test_docs import DOCUMENTS, snippets

NAME, ROBOT = "kuka_kr16_r2010_2", ["--robot", "kuka_kr16_r2010_2"]
BLOCKS = [(path, s) for path in DOCUMENTS for s in snippets(path, "yaml", "yaml operation-tree")]
TREES = [(path, s) for path, s in BLOCKS if s.language == "yaml operation-tree"]
ROBOT_PARTS = [(path, s) for path, s in BLOCKS if s.language == "yaml" and path.name == "robots.md"]
# commands that read programs, and what they need beside one
READ_BY = {
    "simulate": [],
    "pareto": [],
    "optimize": ["--cycle-time", "+10%"],
    "adjust": ["--measured-cycle", "4.5", "--cycle-time", "6"],
}

LINKS = """<link name="{name}"><inertial><mass value="2"/><origin xyz="0 0 0.15"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.005"/></inertial></link>"""
JOINT = """<joint name="{name}" type="{kind}"><origin xyz="0 0 {up}"/><parent link="{parent}"/><child link="{child}"/>
<axis xyz="{axis}"/><limit lower="{low}" upper="2.5" velocity="2" effort="{effort}"/></joint>"""


def ids(blocks):
    return [f"{path.relative_to(ROOT).as_posix()}-{index}" for index, (path, _) in enumerate(blocks)]


def test_every_block_is_tried():
    assert len(TREES) >= 2
    assert len(ROBOT_PARTS) >= 2
    assert len(TREES) + len(ROBOT_PARTS) == len(BLOCKS)
    others = {"example", "robots", "profile", "identify"}  # they read no program, or a log first
    assert set(READ_BY) | others >= set(COMMANDS) - {"convert", "cell"}


@pytest.mark.parametrize("path, snippet", TREES, ids=ids(TREES))
@pytest.mark.parametrize("command", READ_BY)
def test_programs_as_printed(tmp_path, monkeypatch, capsys, path, snippet, command):
    if command not in COMMANDS:
        pytest.skip(f"there is no command {command}")
    monkeypatch.chdir(tmp_path)
    Path("cycle.yaml").write_text(snippet.text, encoding="utf-8")
    robot = [] if "robot" in yaml.safe_load(snippet.text) else ROBOT
    words = [command, "cycle.yaml", *robot, "--payload", "10", *READ_BY[command]]
    assert main([*words, "--json"]) == 0, capsys.readouterr().err
    result = json.loads(capsys.readouterr().out)
    assert result["robot"] == NAME
    assert result["warnings"] == [] or command == "adjust"
    assert main(words) == 0
    if command in ("optimize", "adjust"):
        assert main([*words, "--out", "slower.yaml"]) == 0
        assert main(["simulate", "slower.yaml", *robot, "--payload", "10"]) == 0
    capsys.readouterr()


def arm_of_the_drive_file(folder, drives):
    """A URDF that the drive file of the manual fits: its joints, links and the gripper that it freezes."""
    joints = list(drives["drives"]["joints"])
    links = ["base", "column", *drives["links"], "fore_arm"]
    axes, ups = ("0 0 1", "0 1 0", "0 1 0"), (0.3, 0.2, 0.4)
    parts = [LINKS.format(name=name) for name in links] + ['<link name="flange"/>', '<link name="jaw"/>']
    for place, name in enumerate(joints):
        values = {"axis": axes[place], "up": ups[place], "parent": links[place], "child": links[place + 1]}
        parts.append(JOINT.format(name=name, kind="revolute", low="-2.5", effort=(90, 60, 30)[place], **values))
    ends = '<origin xyz="0 0 0.3"/><parent link="fore_arm"/><child link="flange"/>'
    parts.append(f'<joint name="mount" type="fixed">{ends}</joint>')
    (gripper,) = drives["freeze"]
    parts.append(
        JOINT.format(
            name=gripper, kind="prismatic", low="0", effort="30", axis="1 0 0", up=0, parent="flange", child="jaw"
        )
    )
    (folder / "arm.urdf").write_text("<robot name='arm'>" + "".join(parts) + "</robot>", encoding="utf-8")


def test_robot_files_as_printed(tmp_path, monkeypatch, capsys):
    """The drive file, and its further keys one by one, for a URDF that they fit."""
    monkeypatch.chdir(tmp_path)
    parts = [yaml.safe_load(snippet.text) for _, snippet in ROBOT_PARTS]
    (drives,) = [part for part in parts if "drives" in part]
    arm_of_the_drive_file(tmp_path, drives)
    for further in ({}, *(part for part in parts if "drives" not in part)):
        write_document("arm.drives.yaml", drives | further)
        assert main(["robots", "check", "arm.urdf", "--json"]) == 0, capsys.readouterr().out
        assert json.loads(capsys.readouterr().out)["doubts"] == []
        words = ["profile", "--robot", "arm.urdf", "--payload", "2", "--from", "0,0,0", "--to", "40,20,-30", "--json"]
        assert main(words) == 0, capsys.readouterr().err
        assert json.loads(capsys.readouterr().out)["warnings"] == []
        assert main([*words, "--angles", "pendant"]) == (0 if "pendant" in further else 2)
        capsys.readouterr()


def test_the_readme_starts_from_files_that_come_with_the_package(tmp_path):
    """Its commands, in order, in an empty folder with nothing but the installed package."""
    blocks = snippets(ROOT / "README.md", "console")
    commands = [c for block in blocks for c in block.commands if c.startswith("robojoule")]
    assert any("optimize" in c for c in commands)
    assert commands[0] == "robojoule example cycle.yaml"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for command in commands:
        words = [sys.executable, "-m", *command.split()]
        done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, f"{command}: {done.stderr}"
