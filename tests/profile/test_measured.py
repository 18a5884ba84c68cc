"""Profiles from measured runs of a hidden machine: durations, energies and how sure both are."""

from dataclasses import replace

import numpy as np
import pytest

from robojoule.motion.simulation import MotionPaths
from robojoule.profile.measured import last_pass, measured_profiles
from robojoule.robots.robot import Payload, Robot
from tests.calibration.machines import closed_cycle, joint_controller, observed
from tests.core_cases import kr16

LIMITS = np.arange(30, 101, 5) / 100.0


@pytest.fixture(scope="module")
def paths():
    return closed_cycle()[0]


@pytest.fixture(scope="module")
def profiles(paths):
    return measured_profiles(paths, observed(paths, joint_controller(paths.robot), (1.0, 0.3)), LIMITS)


def test_durations_between_measured_speed_limits_are_those_of_the_machine(paths, profiles):
    truth = paths.with_controller(joint_controller(paths.robot)).durations(LIMITS)
    assert np.abs(profiles.duration_s / truth - 1.0).max() < 0.01
    assert np.abs(profiles.duration_s.sum(axis=0) / truth.sum(axis=0) - 1.0).max() < 0.003


def test_energies_are_those_of_the_machine(paths, profiles):
    truth = paths.with_controller(joint_controller(paths.robot)).simulate(LIMITS).energy_j
    assert np.abs(profiles.energy_j / truth - 1.0).max() < 0.02
    assert profiles.idle_w[:, 0] == pytest.approx(paths.idle_power_start_w, rel=0.02)


def test_energies_of_another_plant_are_learnt(paths):
    """Payload and friction differ from the entry's; the entry alone errs by several per cent."""
    robot = kr16()
    drives = replace(robot.drives, coulomb_nm=1.3 * robot.drives.coulomb_nm, load_friction=0.04)
    plant = Robot(robot.file, Payload(12.0)).variant(drives=drives)
    machine = MotionPaths(plant, paths.start_rad, paths.start_rad + paths.delta_rad, robot)
    learnt = measured_profiles(
        paths, observed(machine, joint_controller(robot), (1.0, 0.3), noise=0.02, seed=4), LIMITS
    )
    truth = machine.with_controller(joint_controller(robot)).simulate(LIMITS).energy_j
    entry = paths.with_controller(joint_controller(robot)).simulate(LIMITS).energy_j
    before, after = (np.abs(found.sum(axis=0) / truth.sum(axis=0) - 1.0).max() for found in (entry, learnt.energy_j))
    assert before > 0.03
    assert after < 0.012
    sure = np.sqrt(
        np.einsum("msp,pq,msq->ms", learnt.energy_gradient_j, learnt.energy_covariance, learnt.energy_gradient_j)
        + learnt.energy_deviation_j**2
    )
    assert np.mean(np.abs(learnt.energy_j - truth) < 2.6 * sure + 0.005 * truth) > 0.97


def test_nothing_much_slower_than_measured_is_allowed(paths):
    slow = np.where(np.arange(paths.motions) == 2, 0.5, 0.3)
    runs = observed(paths, joint_controller(paths.robot), (1.0, slow))
    found = measured_profiles(paths, runs, LIMITS)
    assert LIMITS[found.allowed[2]].min() == pytest.approx(0.45)  # 0.85 of what was measured, in steps of 0.05
    assert LIMITS[found.allowed[0]].min() == pytest.approx(0.3)


def test_the_last_pass_sets_the_total(paths):
    mixed = np.linspace(0.4, 0.9, paths.motions)
    runs = observed(paths, joint_controller(paths.robot), (1.0, 0.3, mixed))
    grid = np.unique(np.append(LIMITS, mixed))
    found = measured_profiles(paths, runs, grid)
    durations, _ = found.at(mixed)
    truth = paths.with_controller(joint_controller(paths.robot)).durations(mixed[:, None]).sum()
    assert durations.sum() == pytest.approx(runs.duration_s[-paths.motions :].sum(), rel=3e-4)
    assert durations.sum() == pytest.approx(truth, rel=4e-4)
    assert found.last_pass is not None
    near = found.cycle_deviation_s(found.last_pass)
    far = found.cycle_deviation_s(np.full(paths.motions, grid.size // 2))
    assert 0.0 < near < far


def test_without_energies_the_entry_s_own_stand_with_a_wide_interval(paths, profiles):
    runs = observed(paths, joint_controller(paths.robot), (1.0, 0.3), energies=False)
    found = measured_profiles(paths, runs, LIMITS)
    entry = paths.with_controller(found.controller).simulate(LIMITS).energy_j
    assert found.energy_j == pytest.approx(entry, rel=0.04)  # gears lose some per cent, which the entry leaves out
    wide, narrow = (np.trace(one.energy_covariance) for one in (found, profiles))
    assert wide > narrow


def test_a_pass_is_every_move_once(paths):
    runs = observed(paths, joint_controller(paths.robot), (1.0, 0.3))
    assert last_pass(runs, paths.moving).tolist() == list(range(paths.motions, 2 * paths.motions))
    half = replace(
        runs,
        motion=runs.motion[:15],
        speed_limits=runs.speed_limits[:15],
        duration_s=runs.duration_s[:15],
        energy_j=runs.energy_j[:15],
    )
    assert last_pass(half, paths.moving) is None


def test_a_meter_in_coarse_steps_does_not_make_small_moves_sure():
    """Of a move of 40 J read in steps of 20 J little is known, and the others' profiles do not suffer."""
    paths, _ = closed_cycle(moves=6)
    share = np.ones((6, 1))
    share[3] = 0.02
    paths = MotionPaths(paths.robot, paths.start_rad, paths.start_rad + share * paths.delta_rad)
    machine = joint_controller(paths.robot)
    runs = observed(paths, machine, (1.0, 0.3))
    read = np.maximum(np.round(runs.energy_j / 20.0), 1.0) * 20.0
    truth = paths.with_controller(machine).simulate(LIMITS).energy_j
    found = measured_profiles(paths, replace(runs, energy_j=read), LIMITS)
    others = np.arange(6) != 3
    assert np.abs(found.energy_j[others] / truth[others] - 1.0).max() < 0.03
    shared = np.einsum("sp,pq,sq->s", found.energy_gradient_j[3], found.energy_covariance, found.energy_gradient_j[3])
    sure = np.sqrt(shared + found.energy_deviation_j[3] ** 2)
    assert (np.abs(found.energy_j[3] - truth[3]) < 2.6 * sure + 0.01 * truth[3]).all()
    assert found.energy_deviation_j[others].mean() / truth[others].mean() < 0.03
