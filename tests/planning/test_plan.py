"""Plans: what they compare, what they warn of, what they refuse."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robojoule.errors import PlanningError
from robojoule.formats.program import Program
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import simulate_trees
from robojoule.planning.plan import Plan, plan_warnings, verify, waiting_until
from robojoule.planning.rule import rule_plan
from robojoule.planning.writeback import write_plans
from robojoule.programs.operation_tree import tree_from_configurations
from tests.core_cases import HOME_DEG, kr16
from tests.planning.trees import busy_tree, tree

DOCUMENT = Path(__file__).parents[2] / "docs" / "operation-tree.md"


@pytest.fixture(scope="module")
def batch():
    return TreeBatch(kr16(), [busy_tree()])


@pytest.fixture(scope="module")
def run(batch):
    return simulate_trees(batch, [batch.trees])[0][0]


def plan(run, **changes) -> Plan:
    figures = {"energy_given_j": 2.0 * run.energy_j, "energy_unoptimized_j": 1.25 * run.energy_j}
    known = {"least_cycle_time_s": 1.0, "bound_j": run.energy_j / 1.5, **figures, **changes}
    return Plan(program=Program(busy_tree()), robot="arm", payload_kg=10.0, run=run, **known)


def test_shares_are_those_of_their_references(run):
    made = plan(run)
    assert made.saving_percent == pytest.approx(50.0)
    assert made.saving_over_unoptimized_percent == pytest.approx(20.0)
    assert made.gap_to_optimum_percent == pytest.approx(50.0)
    nothing = plan(replace(run, energy_j=0.0), energy_given_j=0.0, energy_unoptimized_j=0.0, bound_j=0.0)
    assert nothing.saving_percent == nothing.gap_to_optimum_percent == 0.0


def test_plain_data_holds_every_figure(run):
    made = plan(run, warnings=("mind the gap",))
    data = json.loads(json.dumps(made.to_dict(), allow_nan=False))
    assert data["moves"] == run.to_dict()["moves"]
    assert data["warnings"] == ["mind the gap"]
    derived = {name for name, value in vars(Plan).items() if isinstance(value, property)}
    fields = {"payload_kg", "least_cycle_time_s", "energy_given_j", "energy_unoptimized_j", "bound_j"}
    for name in (derived | fields) - {"moves", "gap_percent"}:
        assert data[name] == getattr(made, name), name
    assert (data["program"], data["robot"]) == ("busy", "arm")
    described = set(re.findall(r"`(\w+)`", DOCUMENT.read_text(encoding="utf-8")))
    assert {*data, *data["moves"][0]} - {"program", "robot", "payload_kg"} <= described
    assert repr(made).startswith("Plan('busy' on 'arm': cycle_time_s=")


def test_a_plan_saves_its_program(run, tmp_path):
    plan(run).save(tmp_path / "out.yaml")
    assert "busy" in (tmp_path / "out.yaml").read_text()


def test_a_short_cycle_waits_and_a_long_one_does_not(run):
    assert waiting_until(run, run.cycle_time_s + 2.0, 400.0) == pytest.approx(run.energy_j + 800.0)
    assert waiting_until(run, run.cycle_time_s - 2.0, 400.0) == run.energy_j


def test_a_written_plan_holds_its_cycle_time(batch):
    schedule = rule_plan(batch.graphs[0], batch.d_min_s, 1.3 * float(batch.least_cycles_s[0]))
    written = write_plans(batch, [[schedule]])[0][0]
    assert verify(batch, written, schedule).cycle_time_s == pytest.approx(schedule.cycle_time_s, abs=1e-9)
    late = written.with_plan({}, waits_after_s={written.moves()[-1].name: 100.0})
    with pytest.raises(PlanningError, match="the simulated cycle of 'busy' differs from the planned one by"):
        verify(batch, late, schedule)


def test_nothing_is_warned_of_without_need(run):
    assert plan_warnings(busy_tree(), run, run) == ()


def test_overloaded_joints_are_named_with_their_move(run):
    ratios = np.linspace(0.5, 1.25, len(run.names))
    (warning,) = plan_warnings(busy_tree(), replace(run, peak_torque_ratios=ratios), run)
    reached = f"a joint torque reaches 125.0 % of its peak limit in move '{run.names[-1]}'"
    assert warning == f"{reached}: lighten the payload or fold the arm"


def test_a_slower_program_is_said_to_count_with_its_own_cycle(run):
    (warning,) = plan_warnings(tree(), run, replace(run, cycle_time_s=run.cycle_time_s + 1.0))
    longer = f"the program as given takes {run.cycle_time_s + 1.0:.4f} s, longer than the plan"
    assert warning == f"{longer}: its energy is that of its own cycle"


def test_an_open_cycle_is_said_to_lack_its_way_back(run):
    one_way = tree_from_configurations("one way", np.radians([HOME_DEG, (10, -90, 90, 0, 0, 0)]))
    (warning,) = plan_warnings(one_way, run, run)
    assert warning == "the cycle ends elsewhere than it starts: the way back is not part of it"
