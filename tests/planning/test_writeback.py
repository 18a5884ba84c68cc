"""The way back into the tree: plans are kept to the cycle time, and their energy is what the written tree takes."""

import numpy as np
import pytest

from robojoule.api import optimize
from robojoule.errors import InputError
from robojoule.formats.program import Program
from robojoule.motion.simulation import MotionPaths
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import simulate_trees
from robojoule.planning.writeback import write_plans
from robojoule.programs.operation_tree import tree_from_configurations
from tests.core_cases import kr16
from tests.planning.trees import busy_tree, dense_plans, tree


@pytest.fixture(scope="module")
def batch():
    return TreeBatch(kr16(), [tree(), busy_tree()])


@pytest.fixture(scope="module")
def times(batch):
    return batch.least_cycles_s[:, None] * np.array([1.0, 1.15, 1.6])


@pytest.fixture(scope="module")
def optimum(batch, times):
    return dense_plans(batch, times, 181)


def write_and_simulate(batch, plans):
    written = write_plans(batch, plans)
    return written, simulate_trees(batch, written)


def test_the_written_tree_takes_exactly_the_cycle_time(batch, times, optimum):
    _, runs = write_and_simulate(batch, optimum)
    for row, cycles in zip(times, runs, strict=True):
        for time, run in zip(row, cycles, strict=True):
            assert run.cycle_time_s == pytest.approx(time, abs=1e-9)


def test_no_wait_is_left_of_rounding(batch):
    """In the README's example the last wait was 4e-16 s."""
    cycles = np.linspace(1.01, 1.6, 25) * batch.least_cycles_s[:, None]
    for trees in write_plans(batch, dense_plans(batch, cycles, 31)):
        waits = [wait for one in trees for move in one.moves() for wait in (move.wait_before_s, move.wait_after_s)]
        assert all(wait == 0.0 or wait > 1e-12 for wait in waits)


def test_feasibility_and_cost_recomputed_from_the_written_tree(batch, optimum):
    written, runs = write_and_simulate(batch, optimum)
    for t, rows in enumerate(batch.rows):
        for k, result in enumerate(written[t]):
            configurations = result.configurations_rad()
            paths = MotionPaths(batch.robot, configurations[:-1], configurations[1:])
            energy, moved = 0.0, 0
            place = "start"
            for operation in result.atomic():
                if operation.type == "move":
                    one = paths.simulate([operation.speed_limit_percent / 100.0])
                    energy += one.energy_j[moved, 0]
                    energy += operation.wait_before_s * paths.idle_power_start_w[moved]
                    energy += operation.wait_after_s * paths.idle_power_end_w[moved]
                    moved, place = moved + 1, "end"
                else:
                    standing = paths.idle_power_start_w[0] if place == "start" else paths.idle_power_end_w[moved - 1]
                    energy += operation.duration_s * (standing + getattr(operation, "power_w", 0.0))
            assert runs[t][k].energy_j == pytest.approx(energy, rel=1e-12)
            assert runs[t][k].energy_j == pytest.approx(optimum[t][k].energy_j, rel=1e-5)
            assert (runs[t][k].durations_s <= batch.d_max_s[rows] + 1e-9).all()


def test_required_waits_and_process_steps_stay(batch, optimum):
    written, _ = write_and_simulate(batch, optimum)
    for result in written[1]:
        steps = {operation.name: operation for operation in result.atomic()}
        assert (steps["part"].duration_s, steps["weld"].duration_s) == (0.2, 0.4)
        assert steps["stay too"].wait_after_s >= 0.1 - 1e-12


def test_planning_a_written_tree_again_gives_the_same_cycle(batch, optimum):
    written, runs = write_and_simulate(batch, optimum)
    again = TreeBatch(batch.robot, [written[0][0]])
    assert again.least_cycles_s[0] <= runs[0][0].cycle_time_s + 1e-9


def test_a_tree_that_goes_elsewhere_is_refused(batch):
    with pytest.raises(InputError, match="does not visit the configurations of 'there and back'"):
        simulate_trees(batch, [[batch.trees[1]], [batch.trees[1]]])


def test_five_calls_plan_a_tree():
    """Profiles -> graph -> solve -> write back -> verify."""
    batch = TreeBatch(kr16(), [tree()])
    plan = dense_plans(batch, 1.3 * batch.least_cycles_s[:, None], 60)[0][0]
    _, runs = write_and_simulate(batch, [[plan]])
    assert runs[0][0].energy_j == pytest.approx(plan.energy_j, rel=1e-3)


def test_the_first_of_tied_motions_keeps_below_its_own_limit_too():
    """A move alone that shares its speed with one at the end of a blended group of faster moves."""
    points = np.radians([[0, -90, 90, 0, 0, 0], [30, -90, 90, 0, 0, 0], [0, -80, 80, 0, 0, 0], [30, -90, 90, 0, 0, 0]])
    one = tree_from_configurations("cycle", points)
    shared = {"speed_limit_percent": 30.0, "speed_group": "shared"}
    one = one.with_settings({"move-1": shared, "move-2": {"zone": {"radius_m": 0.02}}, "move-3": shared})
    plan = optimize(Program(one), kr16(), cycle_time="+5%")
    speeds = [move.speed_limit_percent for move in plan.program.moves]
    assert speeds[0] == speeds[2] <= 30.0
