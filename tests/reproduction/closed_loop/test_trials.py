"""Trials on a hidden machine: what is seen, how plans are judged."""

import numpy as np
import pytest

from reproduction.closed_loop.machines import PERCENT, MachineTable
from reproduction.closed_loop.trials import FULL, Seen, TreeOfMachine, Trial
from robojoule.profile.measured import Measurement
from tests.calibration.machines import closed_cycle, joint_controller

TRIAL = Trial(stamp_s=0.004, energy_noise=0.02, draws=3, reserve=0.002)


@pytest.fixture(scope="module")
def case():
    paths, _ = closed_cycle(seed=21)
    machine = paths.with_controller(joint_controller(paths.robot))
    runs = machine.simulate(PERCENT)
    idle = np.stack([paths.idle_power_start_w, paths.idle_power_end_w], axis=1)
    table = MachineTable(runs.duration_s, runs.energy_j, idle, 0.0, False)
    return paths, table, TreeOfMachine(paths, Measurement(paths), table, {"machine": "joints"})


def test_stamps_hide_a_motion_but_not_the_cycle(case):
    _, table, _ = case
    seen = Seen(table, TRIAL, np.random.default_rng(0))
    seen.run(np.full((3, 10), FULL))
    steps = seen.duration_s / TRIAL.stamp_s
    assert steps == pytest.approx(np.round(steps), abs=1e-6)
    assert np.abs(seen.duration_s - table.duration_s[:, FULL]).max() <= TRIAL.stamp_s + 1e-9
    assert np.abs(seen.duration_s.sum(axis=1) - table.duration_s[:, FULL].sum()).max() <= TRIAL.stamp_s + 1e-9
    assert np.std(seen.energy_j / table.energy_j[:, FULL]) == pytest.approx(0.02, rel=0.6)


def test_plans_after_trials_are_on_time_and_near_the_optimum(case):
    _, _, tree = case
    rows = tree.cases(133.0, TRIAL, np.random.default_rng(1))
    assert [(row["trial"], row["draw"]) for row in rows] == [(trial, draw) for trial in (1, 2) for draw in range(3)]
    for row in rows:
        assert 0.0 <= row["late_percent"] < 0.5
        assert -0.2 < row["gap_percent"] < 1.0
        assert abs(row["promised_saving_percent"] - row["real_saving_percent"]) < 2.0
        assert row["late_nominal_percent"] > 2.0


def test_the_optimum_is_below_every_plan(case):
    _, table, tree = case
    wanted = 1.33 * table.fastest_s
    rng = np.random.default_rng(2)
    best = tree._optimum(wanted, float(table.idle_w.min()))
    rows = np.arange(10)
    for _ in range(200):
        places = rng.integers(20, FULL + 1, 10)
        taken = table.duration_s[rows, places].sum()
        if taken <= wanted:
            cost = table.energy_j[rows, places].sum() + (wanted - taken) * table.idle_w.min()
            assert cost >= best - 1e-6


def test_the_fastest_cycle_has_one_plan_only(case):
    _, table, tree = case
    told = tree._told(np.full(10, FULL), table.fastest_s)
    assert told["late_percent"] == pytest.approx(0.0, abs=1e-9)
    assert told["gap_percent"] == pytest.approx(0.0, abs=1e-6)
    assert told["real_saving_percent"] == pytest.approx(0.0, abs=1e-9)
