"""What holds for programs of every vendor's language."""

import numpy as np
import pytest

from robojoule.api import optimize, simulate
from robojoule.formats.program import load_program
from robojoule.programs.sections import unknown_operations


def in_degrees(program):
    return np.degrees(program.tree.configurations_rad())


def assert_plan_holds(program, robot, target, cycle_time="+20%", **settings):
    """A plan keeps its figures when it is read again, and the next one leaves it as it is."""
    plan = optimize(program, robot, cycle_time=cycle_time)
    assert plan.energy_j <= plan.energy_given_j * (1 + 1e-9)
    plan.save(target)
    new = load_program(target, robot, **settings)
    run = simulate(new, robot)
    assert run.cycle_time_s == pytest.approx(plan.cycle_time_s, abs=1e-6)
    assert run.energy_j == pytest.approx(plan.energy_j, rel=1e-9)
    again = optimize(new, robot, cycle_time="+0%" if unknown_operations(new.tree) else plan.cycle_time_s)
    assert again.program.diff() == ""
    return plan, new
