"""Plans of cells of robots in files: they come back as they were, and files that were changed are found out."""

import json
from pathlib import Path

import numpy as np
import pytest

from robojoule.documents import read_document, write_document
from robojoule.errors import InputError
from robojoule.planning.robot_cells.plan_files import read_robot_plan, simulate_plan_file, write_robot_plan
from tests.planning.robot_cells.cases import plan_of_three, three


@pytest.fixture
def path(tmp_path) -> Path:
    file = tmp_path / "plan.json"
    names = write_robot_plan(three(), plan_of_three(), file)
    assert [name.name for name in names] == ["plan.loader.yaml", "plan.welder.yaml", "plan.unloader.yaml"]
    return file


def test_a_plan_comes_back(path):
    plan = plan_of_three()
    programs, starts, energy_j = read_robot_plan(three(), path)
    assert [one.tree for one in programs] == [one.tree for one in plan.programs]
    assert starts == plan.run.starts_s and energy_j == plan.energy_j
    run = simulate_plan_file(three(), path)
    assert run.violations == () and run.energy_j == pytest.approx(plan.energy_j, rel=1e-12)


def changed_program(path: Path, robot: str, change) -> None:
    file = path.with_name(f"plan.{robot}.yaml")
    data = read_document(file)
    change(data["operations"])
    write_document(file, data)


def no_weld(operations):
    del operations[1]


def short_weld(operations):
    operations[1]["duration_s"] = 0.1


def elsewhere(operations):
    operations[0]["target_deg"][0] += 3.0


def late(operations):
    operations[2]["added_wait_before_s"] = 0.5 + operations[2].get("added_wait_before_s", 0.0)


def other_place(operations):
    (given,) = [one for one in three().robots if one.name == "welder"]
    poses = {"given": given.program.moves[0].target_rad, **given.alternatives["to part"].poses_rad}
    now = operations[0]["target_deg"][1]
    operations[0].pop("target_deg")
    other = [q for q in poses.values() if abs(np.degrees(q[1]) - now) > 1.0]
    operations[0]["target_rad"] = list(map(float, other[0]))


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (no_weld, "does not have the operations"),
        (short_weld, "does not have the operations"),
        (elsewhere, "ends elsewhere than the cell allows"),
        (late, "the cycle of welder takes"),
        (other_place, "do not fit together"),
    ],
)
def test_changed_programs_are_found_out(path, change, problem):
    changed_program(path, "welder", change)
    run = simulate_plan_file(three(), path)
    assert any(problem in one for one in run.violations), run.violations


@pytest.mark.parametrize(
    ("key", "value", "problem"),
    [("start_s", 1.0, "come within"), ("start_s", 1.0, "too early"), ("energy_j", 1.0, "the plan states 1.00 J")],
)
def test_changed_plans_are_found_out(path, key, value, problem):
    data = json.loads(path.read_text(encoding="utf-8"))
    if key == "start_s":
        data["programs"][0][key] += 3.5
    else:
        data[key] = value
    path.write_text(json.dumps(data), encoding="utf-8")
    run = simulate_plan_file(three(), path)
    assert any(problem in one for one in run.violations), run.violations


def test_bad_plan_files_are_refused(path):
    data = json.loads(path.read_text(encoding="utf-8"))
    for change, problem in (
        ({"cell": "another"}, "the plan is for cell"),
        ({"programs": data["programs"][:2]}, "one program for each robot"),
        ({"version": 2}, "version"),
        ({"programs": [{**data["programs"][0], "file": "none.yaml"}, *data["programs"][1:]]}, "no such file"),
    ):
        path.write_text(json.dumps({**data, **change}), encoding="utf-8")
        with pytest.raises(InputError, match=problem):
            read_robot_plan(three(), path)
    with pytest.raises(InputError, match="unknown file type"):
        write_robot_plan(three(), plan_of_three(), path.with_suffix(".csv"))
