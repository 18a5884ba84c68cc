"""What a plan promises, over robots of the catalog and random programs: a small budget of random cases."""

import numpy as np
import pytest

import robojoule as rj
from robojoule.formats.program import Program, load_program
from robojoule.programs.operation_tree import tree_from_configurations

ROBOTS = ["kuka_kr16_r2010_2", "ur_ur10e", "ur_ur3e", "fanuc_lrmate200id", "kuka_kr210_r2700_2", "fanuc_m20_25_18d"]
REACH = 0.35  # share of a joint's range round its middle from which targets are drawn


def random_program(robot, rng):
    """Up to five moves with speed limits, waits and bounds of all kinds."""
    low, high = robot.lower_rad, robot.upper_rad
    middle, reach = (low + high) / 2.0, np.minimum(high - low, 2.0 * np.pi) * REACH
    stops = middle + reach * rng.uniform(-1.0, 1.0, (int(rng.integers(2, 6)), robot.joint_count))
    tree = tree_from_configurations("random", [*stops, stops[0]], robot.name)
    settings = {}
    for move in tree.moves():
        limit = float(rng.choice([100.0, rng.integers(12, 100), round(rng.uniform(5.0, 100.0), 2)]))
        kind = rng.choice(["free", "fixed", "bounded"], p=[0.6, 0.2, 0.2])
        settings[move.name] = {
            "speed_limit_percent": limit,
            "fixed": bool(kind == "fixed"),
            "least_speed_percent": round(limit * 0.7, 2) if kind == "bounded" else None,
            "wait_after_s": float(rng.choice([0.0, 0.3])),
        }
    return Program(tree.with_settings(settings))


@pytest.mark.parametrize("name", ROBOTS)
def test_a_plan_keeps_what_it_promises(name, tmp_path):
    robot = rj.load_robot(name)
    rng = np.random.default_rng(ROBOTS.index(name))
    for case in range(3):
        program = random_program(robot, rng)
        given = rj.simulate(program, robot)
        cycle = given.cycle_time_s * float(rng.choice([1.0, 1.02, 1.2, 2.0]))
        step = float(rng.choice([1.0, 5.0, 0.25]))
        plan = rj.optimize(program, robot, cycle_time=cycle, speed_step=step)
        assert cycle - 1e-3 <= plan.cycle_time_s <= cycle + 1e-9  # waits are whole milliseconds
        assert plan.energy_j <= plan.energy_given_j * (1.0 + 1e-9)
        assert plan.bound_j <= plan.energy_j <= plan.bound_j * (1.0 + 1e-4)  # a part of a millisecond is waited nowhere
        assert plan.peak_torque_ratio <= max(1.0, given.peak_torque_ratio) + 1e-9
        for before, after in zip(program.moves, plan.program.moves, strict=True):
            limit = after.speed_limit_percent
            assert limit <= before.speed_limit_percent
            assert limit >= (before.least_speed_percent or 0.0)
            assert limit == before.speed_limit_percent or (not before.fixed and abs(limit / step % 1.0) < 1e-9)
            assert (after.wait_before_s, after.wait_after_s) == (before.wait_before_s, before.wait_after_s)
        path = tmp_path / f"{case}.csv"
        plan.save(path)
        again = rj.optimize(load_program(path), robot, cycle_time=plan.cycle_time_s, speed_step=step)
        assert again.program.tree.operations == plan.program.tree.operations
        assert again.energy_j == pytest.approx(plan.energy_j, rel=1e-9)
