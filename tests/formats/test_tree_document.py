"""What docs/operation-tree.md shows is read, refused and run as it says."""

import json
import re
from pathlib import Path

import jsonschema
import pytest
import yaml

from robojoule.errors import InputError
from robojoule.formats.program import load_program
from robojoule.formats.tree_files import SCHEMA_FILE
from robojoule.robots import load_robot

DOCUMENT = Path(__file__).parents[2] / "docs" / "operation-tree.md"


@pytest.fixture(scope="module")
def robot():
    return load_robot("kuka_kr16_r2010_2")


def snippets(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def test_documented_tree_is_valid(robot, tmp_path):
    (text,) = snippets("yaml operation-tree")
    jsonschema.Draft202012Validator(json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))).validate(yaml.safe_load(text))
    (tmp_path / "spot-weld.yaml").write_text(text)
    program = load_program(tmp_path / "spot-weld.yaml")
    program.check(robot)
    assert len(program.moves) == 3


def test_documented_messages_are_the_real_ones(robot, tmp_path, monkeypatch):
    (text,) = snippets("yaml operation-tree")
    data = yaml.safe_load(text)
    data["operations"][1]["target_rad"] = [0, 2, 1.5, 0, 0, 0]
    del data["operations"][1]["target_deg"]
    monkeypatch.chdir(tmp_path)
    Path("cell.yaml").write_text(yaml.safe_dump(data))
    (table,) = snippets("csv")
    assert "to part,50,-70," in table
    Path("cycle.csv").write_text(table.replace("to part,50,-70,", "to part,50,up,"))
    said = []
    for name in ("cell.yaml", "cycle.csv"):
        with pytest.raises(InputError) as caught:
            load_program(name).check(robot)
        said.append(str(caught.value))
    assert said == [line.strip() for line in snippets("text")]


def test_documented_table_is_valid(robot, tmp_path):
    (tmp_path / "cycle.csv").write_text(snippets("csv")[0])
    program = load_program(tmp_path / "cycle.csv")
    program.check(robot)
    assert [move.name for move in program.moves] == ["to part", "to belt", "home"]


def test_documented_code_runs(tmp_path, monkeypatch, capsys):
    (text,) = snippets("yaml operation-tree")
    monkeypatch.chdir(tmp_path)
    Path("spot-weld.yaml").write_text(text)
    for code in snippets("python"):
        exec(compile(code, str(DOCUMENT), "exec"), {})
    saved = load_program("spot-weld-slower.json")
    assert {move.name: move.speed_limit_percent for move in saved.moves}["to first spot"] == 40
    assert "10 moves" in capsys.readouterr().out
