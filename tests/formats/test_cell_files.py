"""Cell files and files of plans: what is written is read again; faults are named."""

import json

import pytest
from jsonschema import Draft202012Validator

from robojoule.documents import read_document
from robojoule.errors import InputError
from robojoule.formats.cell_files import SCHEMA_FILE, CellDocument, cell_data, read_cell, write_cell
from robojoule.formats.cells import load_cells
from robojoule.planning.cells.check import check_plan
from robojoule.planning.cells.plan_files import read_plans, write_plans
from robojoule.planning.cells.solve import solve_cell
from tests.planning.cells.cases import generated, two_robots


@pytest.mark.parametrize("suffix", [".yaml", ".json"])
def test_a_cell_survives_its_file(tmp_path, suffix):
    cell = generated(2, 0, (4, 6))
    path = tmp_path / f"cell{suffix}"
    write_cell(cell, path)
    (read,) = load_cells(path)
    assert cell_data(read) == cell_data(cell)


def test_breakpoints_survive_too(tmp_path):
    data = cell_data(two_robots())
    movement = data["robots"][0]["dynamic"][0]["movements"][0]
    for key in ("shortest_s", "longest_s", "terms"):
        del movement[key]
    movement |= {"durations_s": [1.0, 2.0, 4.0], "energies_j": [800.0, 500.0, 700.0]}
    path = tmp_path / "cell.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    cell = read_cell(path)
    assert cell_data(cell) == data
    assert solve_cell(cell).status == "optimal"


def test_the_schema_is_that_of_the_reader(tmp_path):
    schema = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
    assert schema == CellDocument.model_json_schema()
    path = tmp_path / "cell.yaml"
    write_cell(two_robots(), path)
    Draft202012Validator(schema).validate(read_document(path))


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda d: d.pop("cycle_time_s"), "cycle_time_s: this key is missing"),
        (lambda d: d.update(cycle=3), "cycle: unknown key"),
        (lambda d: d["robots"][0].update(last="a9"), "robot A: the last activity of the cycle, 'a9'"),
        (lambda d: d["robots"][0]["dynamic"][0]["movements"][0].pop("terms"), "must be given in one way"),
        (lambda d: d["robots"][0]["dynamic"][0]["movements"][0].update(terms=[[-1, -5]]), "concave"),
        (lambda d: d["lags"][0].update(first="zz"), "'zz', which does not exist"),
    ],
)
def test_faults_of_cell_files_are_named(tmp_path, change, problem):
    data = cell_data(two_robots())
    change(data)
    path = tmp_path / "cell.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(InputError) as raised:
        read_cell(path)
    assert problem in str(raised.value)


@pytest.mark.parametrize("suffix", [".csv", ".json"])
def test_plans_survive_their_file(tmp_path, suffix):
    cell = two_robots()
    plan = solve_cell(cell)
    path = tmp_path / f"plan{suffix}"
    write_plans([plan], path)
    (read,) = read_plans(path)
    assert read.to_dict() == plan.to_dict()
    assert check_plan(cell, read).feasible


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "not a table of plans"),
        ("a,b\n1,2\n", "not a table of plans"),
        ("cell,status,cycle_time_s,bound_j,runtime_s,robot,activity,option,mode,start_s,duration_s,energy_j\nx,1\n",
         "line 2: the row has more or fewer cells"),
        ("cell,status,cycle_time_s,bound_j,runtime_s,robot,activity,option,mode,start_s,duration_s,energy_j\n"
         "c,optimal,9,1,1,A,a,p,on,0,x,1\n", "line 2, column duration_s: 'x' is not a number"),
        ("cell,status,cycle_time_s,bound_j,runtime_s,robot,activity,option,mode,start_s,duration_s,energy_j\n"
         "c,optimal,0,1,1,A,a,p,on,0,1,1\n", "line 2, column cycle_time_s: the cycle time must be above 0 s"),
        ("cell,status,cycle_time_s,bound_j,runtime_s,robot,activity,option,mode,start_s,duration_s,energy_j\n"
         "c,optimal,-10,1,1,A,a,p,on,0,1,1\n", "line 2, column cycle_time_s: the cycle time must be above 0 s"),
        ("cell,status,cycle_time_s,bound_j,runtime_s,robot,activity,option,mode,start_s,duration_s,energy_j\n"
         "c,optimal,9,1,-5,A,a,p,on,0,1,1\n", "line 2, column runtime_s: the runtime must not be below 0 s"),
    ],
)  # fmt: skip
def test_faults_of_plan_tables_are_named(tmp_path, text, problem):
    path = tmp_path / "plan.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as raised:
        read_plans(path)
    assert problem in str(raised.value)


HEAD_FAULTS = {
    "energy_j": (1.0, "plans.0.energy_j: the plan states 1, its steps and its bound give"),
    "gap_percent": (3.0, "plans.0.gap_percent: the plan states 3"),
    "largest_mean_power_w": (-1.0, "plans.0.largest_mean_power_w: the plan states -1"),
    "status": ("proven", "plans.0.status"),
    "runtime_s": (-1.0, "plans.0.runtime_s"),
    "cycle_time_s": (0.0, "plans.0.cycle_time_s: the cycle time must be above 0 s"),
}


@pytest.mark.parametrize(("key", "value", "problem"), [(key, *fault) for key, fault in HEAD_FAULTS.items()])
def test_a_plan_that_states_what_its_steps_do_not_give_is_refused(tmp_path, key, value, problem):
    path = tmp_path / "plan.json"
    write_plans([solve_cell(two_robots())], path)
    data = json.loads(path.read_text(encoding="utf-8"))
    data["plans"][0][key] = value
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(InputError) as raised:
        read_plans(path)
    assert problem in str(raised.value)


def test_a_file_without_a_plan_and_a_table_with_an_unknown_status_are_refused(tmp_path):
    empty, table = tmp_path / "plan.json", tmp_path / "plan.csv"
    write_plans([], empty)
    with pytest.raises(InputError, match="holds no plan"):
        read_plans(empty)
    write_plans([solve_cell(two_robots())], table)
    table.write_text(table.read_text(encoding="utf-8").replace(",optimal,", ",proven,"), encoding="utf-8")
    with pytest.raises(InputError, match="line 2, column status: unknown status 'proven'; allowed: optimal, feasible"):
        read_plans(table)
