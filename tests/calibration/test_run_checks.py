"""Runs that cannot be are refused, machines that differ are not."""

from dataclasses import replace

import numpy as np
import pytest

from robojoule.calibration.run_checks import check_runs
from robojoule.errors import InputError
from tests.calibration.machines import closed_cycle, joint_controller, observed


@pytest.fixture(scope="module")
def case():
    paths, _ = closed_cycle(moves=4)
    return paths, observed(paths, joint_controller(paths.robot), (1.0, 0.4))


def with_row(values, row, value):
    changed = values.copy()
    changed[row] = value
    return changed


@pytest.mark.parametrize(("exponent", "dead_s"), [(0.0, 0.0), (1.0, 0.05)])
def test_machines_that_differ_from_their_entry_pass(case, exponent, dead_s):
    paths, _ = case
    machine = joint_controller(paths.robot, exponent, dead_s)
    check_runs(paths, observed(paths, machine, (1.0, 0.4, 0.1), stamp_s=0.1, noise=0.1))


def test_other_energies_of_the_whole_arm_pass(case):
    paths, runs = case
    for factor in (0.3, 3.0):
        check_runs(paths, replace(runs, energy_j=factor * runs.energy_j))
    check_runs(paths, replace(runs, energy_j=np.full(runs.motion.size, np.nan)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: {"duration_s": 1000.0 * r.duration_s}, r"duration_s: row 1 took \d+ s at 100 %, where the robot's"),
        (lambda r: {"duration_s": 0.2 * r.duration_s}, r"duration_s: row \d took .*allowed: 0.5 to 100 times that"),
        (lambda r: {"speed_limits": r.speed_limits / 100.0}, r"row \d took .* at 1 %.*speed limits in percent"),
        (
            lambda r: {"speed_limits": r.speed_limits[::-1]},
            "contradict each other: .* a lower speed limit takes longer",
        ),
        (lambda r: {"energy_j": -r.energy_j}, "energy_j: energies are -.* times what the robot's entry draws"),
        (lambda r: {"energy_j": 0.0 * r.energy_j}, "energies are 0 times"),
        (lambda r: {"energy_j": r.energy_j / 1000.0}, "check that they are joules"),
        (lambda r: {"energy_j": r.energy_j / 3600.0}, "check that they are joules"),
        (lambda r: {"energy_j": 1000.0 * r.energy_j}, "check that they are joules"),
        (lambda r: {"energy_j": with_row(r.energy_j, 2, -r.energy_j[2])}, "row 3 took -.* would go with the others"),
        (lambda r: {"energy_j": with_row(r.energy_j, 6, 9.0 * r.energy_j[6])}, "row 7 took .*empty where it was not"),
    ],
)
def test_slips_of_the_pen_are_refused_with_their_row(case, change, message):
    paths, runs = case
    with pytest.raises(InputError, match=message):
        check_runs(paths, replace(runs, **change(runs)))


def test_repetitions_must_be_alike(case):
    paths, runs = case
    again = runs.joined(replace(runs, duration_s=1.4 * runs.duration_s))
    with pytest.raises(
        InputError, match=r"rows \d+ and \d+ contradict each other: .* runs that are repeated are alike"
    ):
        check_runs(paths, again)
    check_runs(paths, runs.joined(replace(runs, duration_s=1.05 * runs.duration_s)))


@pytest.mark.parametrize("energy_j", [0.0, -5.0])
def test_a_small_move_that_draws_nothing_is_refused(case, energy_j):
    """A move so short that the others say nothing of its share: a meter that reads whole kilojoules shows none."""
    paths, _ = case
    short = type(paths)(paths.robot, paths.start_rad, paths.start_rad + paths.delta_rad * [[1], [1], [1], [0.02]])
    seen = observed(short, joint_controller(paths.robot), (1.0, 0.4))
    check_runs(short, seen)
    with pytest.raises(InputError, match=r"row 8 took .* J, where the robot's entry draws .*empty where it was not"):
        check_runs(short, replace(seen, energy_j=with_row(seen.energy_j, 7, energy_j)))
