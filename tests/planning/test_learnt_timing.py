"""Plans, trade-offs and profiles by the timing that runs show, and by the entry's own where they show none."""

import numpy as np
import pytest

import robojoule as rj
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.planning.batch import TreeBatch
from robojoule.planning.learnt_timing import with_learnt_timing
from robojoule.programs.operation_tree import tree_from_configurations
from tests.calibration.machines import closed_cycle, joint_controller, observed
from tests.core_cases import kr16

MOVE = "move-02"
KEPT = "the entry's own timing meets the runs as well as any rule, so it is kept"


@pytest.fixture(scope="module")
def cycle():
    paths, points = closed_cycle(moves=10)
    return paths, rj.Program(tree_from_configurations("cycle", points, kr16().name))


def by_the_entry(paths, scatter=0.0):
    """Runs of a machine that is as its entry says, each off by chance."""
    limits = (1.0, 0.4)
    seconds = paths.durations(limits)
    seconds = seconds * (1.0 + scatter * np.random.default_rng(3).standard_normal(seconds.shape))
    moves = np.tile(np.arange(paths.motions), len(limits))
    none = np.full(moves.size, np.nan)
    return MeasuredRuns("runs.csv", moves, np.repeat(limits, paths.motions), seconds.T.ravel(), none, 0.001)


@pytest.mark.parametrize("scatter", [0.0, 0.012])
def test_where_no_rule_is_better_the_entry_stays_and_that_is_told(cycle, scatter):
    paths, program = cycle
    runs = by_the_entry(paths, scatter)
    batch = TreeBatch(kr16(), [program.tree], 0.01)
    learnt, warnings = with_learnt_timing(batch, runs)
    assert learnt.robot.controller is None
    assert warnings
    found = rj.identify_timing(runs, program, kr16())
    assert found.warnings == warnings and found.robot_file().controller is None
    plan = rj.optimize(program, kr16(), cycle_time="+20%", runs=runs, profiles="simulated")
    without = rj.optimize(program, kr16(), cycle_time="+20%")
    assert plan.energy_j == pytest.approx(without.energy_j)
    curve = rj.pareto(program, kr16(), runs=runs, profiles="simulated")
    assert curve.curve.energies_j == pytest.approx(rj.pareto(program, kr16()).curve.energies_j)
    profile = rj.energy_profile(kr16(), program=program, move=MOVE, runs=runs, profiles="simulated")
    assert profile.durations_s == pytest.approx(rj.energy_profile(kr16(), program=program, move=MOVE).durations_s)
    for result in (plan, curve, profile):
        assert set(warnings) <= set(result.warnings)
    if scatter == 0.0:
        assert warnings == (KEPT,)


def test_what_runs_at_one_speed_leave_open_is_told_by_plans(cycle):
    paths, program = cycle
    runs = observed(paths, joint_controller(paths.robot), (1.0,))
    plan = rj.optimize(program, kr16(), cycle_time="+20%", runs=runs, profiles="simulated")
    assert any("slower runs are a guess" in warning for warning in plan.warnings)
    learnt, _ = with_learnt_timing(TreeBatch(kr16(), [program.tree], 0.01), runs)
    assert learnt.robot.controller is not None
    assert learnt.paths.durations([1.0])[:, 0] == pytest.approx(runs.duration_s, rel=0.02)


def test_coarse_stamps_do_not_hide_what_runs_show(cycle):
    """A machine 20 % slower by a clock of 0.1 s: rounding alone is several per cent of such short moves."""
    paths, _ = cycle
    limits = (1.0, 0.5, 0.25)
    truth = observed(paths, joint_controller(paths.robot), limits)
    slower = 1.2 * paths.durations(limits).T.ravel()
    stamped = 0.1 * np.round(slower / 0.1)
    runs = MeasuredRuns("runs.csv", truth.motion, truth.speed_limits, stamped, truth.energy_j, 0.1)
    batch = TreeBatch(kr16(), [rj.Program(cycle[1].tree).tree], 0.01)
    learnt, warnings = with_learnt_timing(batch, runs)
    assert learnt.robot.controller is not None and warnings == ()
    seconds = learnt.paths.durations((1.0,)).sum()
    assert seconds == pytest.approx(1.2 * paths.durations((1.0,)).sum(), rel=0.03)


def test_a_dead_time_is_one_that_robot_files_hold(cycle):
    paths, program = cycle
    runs = by_the_entry(paths)
    ahead = MeasuredRuns("runs.csv", runs.motion, runs.speed_limits, runs.duration_s - 0.12, runs.energy_j, 0.001)
    found = rj.identify_timing(ahead, program, kr16())
    assert found.controller.dead_time_s >= -0.1
    found.robot_file()
