"""`robojoule robots`: the catalog."""

import json

import pytest

from robojoule.cli import main
from robojoule.documents import write_document
from tests.robots.test_urdf import DRIVES, TWO_JOINTS


def test_robots_lists_the_catalog(capsys):
    assert main(["robots", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["robots"]
    assert "kuka_kr16_r2010_2" in [row["name"] for row in rows]
    assert main(["robots"]) == 0
    assert "kuka_kr16_r2010_2" in capsys.readouterr().out


@pytest.fixture
def arm(tmp_path, monkeypatch):
    """The name of a URDF of two joints in this folder, without a drive file."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.urdf").write_text(TWO_JOINTS)
    return "arm.urdf"


def test_scale_writes_a_drive_file_that_check_accepts(arm, capsys):
    assert main(["robots", "scale", arm, "--rated-payload", "2", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["out"] == "arm.drives.yaml"
    assert result["provenance"]["drives"]["kind"] == "scaled"
    assert main(["robots", "check", arm]) == 0
    assert "arm.urdf can be used" in capsys.readouterr().out
    assert main(["robots", "scale", arm, "--rated-payload", "2"]) == 2
    assert "arm.drives.yaml: the file exists already" in capsys.readouterr().err


def test_check_tells_everything_at_once(arm, tmp_path, capsys):
    """Missing limits and missing inertia in one run, each with the key that mends it, and exit code 2."""
    for cut in ('effort="120"', 'velocity="4"', '<mass value="2"/>'):
        text = (tmp_path / arm).read_text()
        assert cut in text
        (tmp_path / arm).write_text(text.replace(cut, '<mass value="0"/>' if "mass" in cut else ""))
    write_document(tmp_path / "arm.drives.yaml", DRIVES)
    assert main(["robots", "check", arm, "--json"]) == 2
    errors = json.loads(capsys.readouterr().out)["errors"]
    assert [error["allowed"] for error in errors[:2]] == [
        "a number: limits.shoulder.effort_nm in arm.drives.yaml",
        "a number: limits.elbow.velocity_rad_s in arm.drives.yaml",
    ]
    assert main(["robots", "check", arm]) == 2
    shown = capsys.readouterr().out.splitlines()
    assert len(shown) == len(errors)
    assert all(line.startswith("error: ") for line in shown)
    assert main(["profile", "--robot", arm, "--from", "0,0", "--to", "9,9"]) == 2
    assert f"(and {len(errors) - 1} more)" in capsys.readouterr().err


def test_check_takes_catalog_names_and_xacro_files(tmp_path, capsys):
    assert main(["robots", "check", "ur_ur5e"]) == 0
    assert "ur_ur5e can be used" in capsys.readouterr().out
    path = tmp_path / "arm.urdf.xacro"
    path.write_text("<robot/>")
    assert main(["robots", "check", str(path)]) == 2
    assert "this is a xacro file" in capsys.readouterr().out


@pytest.mark.parametrize(
    "words, said",
    [
        (["--rated-payload", "0"], "--rated-payload: 0 is out of range; allowed: 0.01 to 10000 kg"),
        (["--rated-payload", "1e9"], "--rated-payload: 1e+09 is out of range"),
        (["--rated-payload", "2", "--out", "x.json"], "--out: unknown file type"),
        (["--rated-payload", "2", "--freeze", "elbow"], "--freeze: 'elbow' names no position"),
        (["--rated-payload", "2", "--freeze", "elbow=up"], "--freeze: 'up' is not a number"),
        ([], "rated-payload"),
    ],
)
def test_scale_refuses(arm, tmp_path, capsys, words, said):
    assert main(["robots", "scale", arm, *words]) == 2
    assert said in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == [arm]
