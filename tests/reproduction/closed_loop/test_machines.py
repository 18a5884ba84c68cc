"""Hidden machines: what they take against the nominal controller, and what each one's peculiarity is."""

import numpy as np
import pytest

from reproduction.closed_loop.machines import PERCENT, hidden_machines
from robojoule.motion.simulation import MotionPaths
from tests.core_cases import kr16, random_motions
from tests.reproduction.closed_loop.cases import PARAMS

RANGES = PARAMS.close_the_loop.machines


@pytest.fixture(scope="module")
def drawn():
    robot = kr16()
    start, end = random_motions(robot, 6)
    machines = {machine.name: machine for machine in hidden_machines(robot, RANGES, seed=3)}
    nominal = MotionPaths(robot, start, end)
    return machines, {name: machine.table(robot, start, end) for name, machine in machines.items()}, nominal


def test_there_are_four_inside_the_rules_and_four_outside(drawn):
    machines, _, _ = drawn
    assert [machine.inside for machine in machines.values()] == [True] * 4 + [False] * 4


def test_draws_are_those_of_the_seed():
    first, again, other = (
        next(hidden_machines(kr16(), RANGES, seed)).controller.acceleration_rad_s2 for seed in (3, 3, 4)
    )
    assert (first == again).all()
    assert (first != other).all()


def test_slower_is_slower_and_scaled_accelerations_matter_at_low_speed(drawn):
    _, tables, nominal = drawn
    planned = nominal.durations(PERCENT)
    assert (tables["slower"].duration_s > planned).all()
    scaled = tables["scaled acceleration, other plant"].duration_s / planned
    assert scaled[:, -1] == pytest.approx(1.0, abs=1e-6)
    assert (scaled[:, 20] > 1.02).all()


def test_the_odd_one_rounds_up_and_stands(drawn):
    _, tables, _ = drawn
    steps = (tables["odd"].duration_s - RANGES.odd_dead_s) / RANGES.odd_step_s
    assert steps == pytest.approx(np.round(steps), abs=1e-6)


def test_the_asymmetric_one_takes_another_time_back(drawn):
    machines, _, nominal = drawn
    machine = machines["asymmetric, other plant"]
    back = machine.table(nominal.robot, nominal.start_rad + nominal.delta_rad, nominal.start_rad)
    there = machine.table(nominal.robot, nominal.start_rad, nominal.start_rad + nominal.delta_rad)
    assert (np.abs(back.duration_s / there.duration_s - 1.0).max(axis=1) > 0.01).sum() >= 3


def test_energies_of_machines_that_stand_longer_hold_their_standing(drawn):
    machines, tables, nominal = drawn
    odd = tables["odd"]
    by_law = nominal.with_controller(machines["odd"].controller).simulate(PERCENT)
    extra = odd.energy_j - by_law.energy_j
    expected = (odd.duration_s - by_law.duration_s) * nominal.idle_power_end_w[:, None]
    assert extra == pytest.approx(expected, abs=1e-6)
