"""Runs of motions against limits of physics, a plain reference and hard cases."""

import dataclasses

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.motion.quadrature import RunQuadrature
from robojoule.motion.simulation import Engines, MotionPaths
from robojoule.robots import list_robots, load_robot
from robojoule.robots.robot import Payload
from tests.core_cases import HARD_MOTIONS_DEG, SPEED_LIMITS, hard_paths, kr16, random_motions

PARTS = ("potential_j", "friction_j", "copper_j", "braking_j", "inverter_j", "base_j", "drive_active_j")


@pytest.fixture(scope="module")
def robot():
    return kr16()


@pytest.fixture(scope="module")
def paths(robot):
    return MotionPaths(robot, *random_motions(robot, 40))


@pytest.fixture(scope="module")
def runs(paths):
    return paths.simulate(SPEED_LIMITS)


def test_parts_add_up_to_the_energy(runs):
    assert sum(getattr(runs, name) for name in PARTS) == pytest.approx(runs.energy_j, rel=1e-9)


def test_energy_balance(robot, paths, runs):
    """Work of the joint torques = change of potential energy (kinetic is zero at both ends) + friction loss."""
    pin = pytest.importorskip("pinocchio")
    data = robot.model.createData()
    ends = (paths.start_rad, paths.start_rad + paths.delta_rad)
    potential = [np.array([pin.computePotentialEnergy(robot.model, data, q) for q in end]) for end in ends]
    lifted = (potential[1] - potential[0])[:, None]
    for motion in range(0, paths.motions, 7):
        for column, limit in enumerate(SPEED_LIMITS):
            samples = paths.sample(motion, limit, 4000.0)
            velocity = samples.path_velocity_per_s[:, None] * paths.delta_rad[motion]
            magnitude = np.trapezoid(np.abs((samples.torque_nm * velocity).sum(axis=1)), samples.time_s)
            assert abs(runs.potential_j[motion, column] - lifted[motion, 0]) <= 1e-6 * magnitude


def test_energies_equal_a_plain_fine_reference(robot, paths, runs):
    """Same motion sample by sample at 16 kHz: full inverse dynamics, friction, rotor, copper and bus by hand."""
    pin = pytest.importorskip("pinocchio")
    drives, data = robot.drives, robot.model.createData()
    for motion, column in ((0, 9), (3, 4), (8, 0), (21, 9), (33, 6)):
        velocity = paths.peak_velocities(SPEED_LIMITS)[motion, column]
        law = paths.law(motion, float(velocity))
        time = np.linspace(0.0, law.total_s, int(16000 * law.total_s))
        s, s1, s2, _ = law.at(time)
        delta = paths.delta_rad[motion]
        power = np.empty(len(time))
        for k in range(len(time)):
            qd, qdd = delta * s1[k], delta * s2[k]
            torque = pin.rnea(robot.model, data, paths.start_rad[motion] + s[k] * delta, qd, qdd)
            torque += drives.gear_ratio**2 * drives.rotor_inertia_kg_m2 * qdd
            torque += drives.coulomb_nm * np.sign(delta) + drives.viscous_nm_s_per_rad * qd
            bus = torque @ qd + drives.copper_w_per_nm2 @ (torque / drives.gear_ratio) ** 2
            power[k] = drives.base_power_w + drives.drive_active_power_w + max(bus, 0.0) / drives.inverter_efficiency
        assert np.trapezoid(power, time) == pytest.approx(runs.energy_j[motion, column], rel=2e-5)


def test_energies_at_250_hz_within_a_tenth_of_a_percent_of_4_khz(robot, paths):
    for motion in range(0, paths.motions, 5):
        for limit in (0.1, 0.5, 1.0):
            fine, coarse = (paths.sample(motion, limit, rate) for rate in (4000.0, 250.0))
            reference = np.trapezoid(fine.power_w, fine.time_s)
            assert np.trapezoid(coarse.power_w, coarse.time_s) == pytest.approx(reference, rel=1e-3)
            assert coarse.time_s[-1] == fine.time_s[-1] == pytest.approx(paths.durations([limit])[motion, 0], abs=1e-9)


def test_quadrature_has_converged(robot, paths, runs):
    class Finer(MotionPaths):
        def _quadrature(self, path_nodes: int) -> RunQuadrature:
            return RunQuadrature(30, 40, 70)

    finer = Finer(robot, paths.start_rad, paths.start_rad + paths.delta_rad).simulate(SPEED_LIMITS)
    assert finer.energy_j == pytest.approx(runs.energy_j, rel=1e-4)
    for name in ("potential_j", "friction_j", "copper_j"):  # no kink
        assert getattr(finer, name) == pytest.approx(getattr(runs, name), abs=1e-6 * runs.energy_j.max())


def test_runs_do_not_depend_on_the_motions_beside_them(robot):
    start, end = random_motions(robot, 90, seed=3)
    whole = MotionPaths(robot, start, end).simulate(SPEED_LIMITS)
    for part in (slice(0, 1), slice(5, 47), slice(47, 90)):
        alone = MotionPaths(robot, start[part], end[part]).simulate(SPEED_LIMITS)
        for field in dataclasses.fields(whole):
            assert np.array_equal(getattr(alone, field.name), getattr(whole, field.name)[part])


def test_a_subset_has_the_runs_of_the_whole(robot, paths, runs):
    heavy = MotionPaths(kr16(14.0), paths.start_rad, paths.start_rad + paths.delta_rad, controller=robot)
    for whole, expected in ((paths, runs), (heavy, heavy.simulate(SPEED_LIMITS))):
        for rows in (np.array([7, 2]), slice(3, 20)):
            part = whole.subset(rows).simulate(SPEED_LIMITS)
            for field in dataclasses.fields(part):
                assert np.array_equal(getattr(part, field.name), getattr(expected, field.name)[rows])


def test_at_rest_power_is_idle_power(robot):
    q = np.radians([[0, -90, 90, 0, 0, 0], [30, -40, 20, 10, 50, 0]])
    still = MotionPaths(robot, q, q)
    runs = still.simulate(SPEED_LIMITS)
    assert np.all(runs.duration_s == 0) and np.all(runs.energy_j == 0)
    assert still.sample(0, 1.0).power_w == pytest.approx([still.idle_power_start_w[0]])
    assert still.idle_power_start_w == pytest.approx(still.idle_power_end_w)


def test_slow_motion_approaches_idle_power(robot):
    """Without Coulomb friction and drive-active power the mean power tends to idle as the speed goes to zero."""
    bare = kr16()
    bare = bare.variant(drives=dataclasses.replace(robot.drives, coulomb_nm=np.zeros(6), drive_active_power_w=0.0))
    start = np.radians([0.0, -90, 90, 0, 0, 0])
    end = start + np.array([1.0, 0, 0, 0, 0, 0])  # joint 1 moves nothing against gravity: idle is the same all along
    paths = MotionPaths(bare, start, end)
    runs = paths.simulate([1e-4])
    assert runs.energy_j[0, 0] / runs.duration_s[0, 0] == pytest.approx(paths.idle_power_start_w[0], rel=1e-4)


def test_constant_speed_single_joint_against_the_closed_form():
    """Joint 6 of the bare arm carries nothing: at constant speed its motor works against friction only."""
    robot = kr16(0.0)
    start = np.radians([0.0, -90, 90, 0, 0, -300])
    paths = MotionPaths(robot, start, start + np.radians([0, 0, 0, 0, 0, 600.0]))
    drives = robot.drives
    samples = paths.sample(0, 0.3, 1000.0)
    cruise = (samples.path_acceleration_per_s2 == 0) & (samples.path_velocity_per_s > 0)
    qd = 0.3 * robot.velocity_rad_s[5]
    friction = drives.coulomb_nm[5] + drives.viscous_nm_s_per_rad[5] * qd
    holding = (paths.idle_power_start_w[0] - drives.base_power_w) * drives.inverter_efficiency
    copper = drives.copper_w_per_nm2[5] * (friction / drives.gear_ratio[5]) ** 2 + holding
    expected = drives.base_power_w + drives.drive_active_power_w + (friction * qd + copper) / drives.inverter_efficiency
    assert cruise.sum() > 100
    assert samples.power_w[cruise] == pytest.approx(expected, rel=1e-6)


def test_turning_joint_1_changes_no_energy(robot, paths, runs):
    turn = np.zeros(6)
    turn[0] = 1.234
    turned = MotionPaths(robot, paths.start_rad + turn, paths.start_rad + paths.delta_rad + turn)
    assert turned.simulate(SPEED_LIMITS).energy_j == pytest.approx(runs.energy_j, rel=1e-12)


def test_kinetic_energy_along_a_motion_does_not_fall_with_payload():
    pin = pytest.importorskip("pinocchio")
    states = np.random.default_rng(2).normal(size=(50, 2, 6))
    light, heavy = kr16(2.0), kr16(14.0)
    for q, qd in states:
        less, more = (pin.computeKineticEnergy(r.model, r.model.createData(), q, qd) for r in (light, heavy))
        assert more >= less


def test_durations_fall_with_the_speed_limit_and_torques_keep_their_limit(paths, runs):
    assert np.all(np.diff(runs.duration_s, axis=1) <= 1e-12)
    assert runs.peak_torque_ratio.max() <= 1.0
    assert paths.durations(SPEED_LIMITS) == pytest.approx(runs.duration_s, abs=1e-9)


def test_durations_never_rise_with_the_speed_limit(robot):
    paths = MotionPaths(robot, *random_motions(robot, 400, seed=4))
    assert np.diff(paths.durations(np.linspace(0.02, 1.0, 300)), axis=1).max() <= 1e-12


def test_joint_velocities_keep_the_speed_limit(robot, paths):
    for limit in (0.1, 0.55, 1.0):
        speed = paths.peak_velocities([limit])[:, 0, None] * np.abs(paths.delta_rad)
        assert np.all(speed <= limit * robot.velocity_rad_s * (1 + 1e-12))


def test_speed_limits_for_durations_is_the_inverse(paths):
    fastest = paths.minimum_durations()
    for factor in (1.0, 1.0001, 1.3, 4.0):
        limits = paths.speed_limits_for_durations(factor * fastest)
        assert paths.durations(limits[:, None])[:, 0] == pytest.approx(factor * fastest, abs=1e-9)


def test_shorter_than_possible_is_refused(paths):
    with pytest.raises(InputError, match=r"motion 1 cannot take .* at least .* \(full speed\)"):
        paths.speed_limits_for_durations(0.9 * paths.minimum_durations())


@pytest.mark.parametrize("limits", [[0.0], [-0.1], [1.0001], [float("nan")]])
def test_speed_limits_out_of_range_are_refused(paths, limits):
    with pytest.raises(InputError, match="speed limit is out of range; allowed: above 0 and at most 1"):
        paths.durations(limits)


@pytest.mark.parametrize("case", range(len(HARD_MOTIONS_DEG)), ids=HARD_MOTIONS_DEG.keys())
def test_hard_motions(robot, case):
    paths = hard_paths(robot)
    runs = paths.simulate(SPEED_LIMITS)
    assert np.all(np.isfinite(runs.energy_j[case])) and np.all(runs.energy_j[case] > 0)
    samples = paths.sample(case, 1.0, 4000.0)
    assert np.trapezoid(samples.power_w, samples.time_s) == pytest.approx(runs.energy_j[case, -1], rel=1e-3)


def test_lowering_needs_less_than_lifting(robot):
    names = list(HARD_MOTIONS_DEG)
    runs = hard_paths(robot).simulate([0.4])
    assert runs.potential_j[names.index("lift"), 0] == pytest.approx(-runs.potential_j[names.index("lower"), 0])
    assert runs.energy_j[names.index("lower"), 0] < runs.energy_j[names.index("lift"), 0]
    assert runs.braking_j[names.index("lower"), 0] > runs.braking_j[names.index("lift"), 0]


def test_regeneration_returns_energy(robot):
    start, end = random_motions(robot, 5)
    plain = MotionPaths(robot, start, end).simulate([1.0])
    returning = kr16()
    returning = returning.variant(drives=dataclasses.replace(robot.drives, regeneration_efficiency=0.8))
    runs = MotionPaths(returning, start, end).simulate([1.0])
    assert runs.braking_j == pytest.approx(0.2 * plain.braking_j)
    assert runs.energy_j == pytest.approx(plain.energy_j - 0.8 * plain.braking_j)
    assert sum(getattr(runs, name) for name in PARTS) == pytest.approx(runs.energy_j)


def test_payload_without_mass_is_the_bare_robot():
    pytest.importorskip("pinocchio")
    q = np.radians([10.0, -60, 40, 20, 30, 0])
    bare, none = kr16(0.0), kr16().file
    assert bare.model.inertias[6].mass == pytest.approx(
        sum(link.mass_kg for name, link in none.links.items() if name == "link_6" and link)
    )
    with pytest.raises(InputError, match="payload mass"):
        Payload(-1.0)
    assert np.isfinite(MotionPaths(bare, q, q + 0.1).simulate([1.0]).energy_j).all()


@pytest.mark.parametrize("name", list_robots())
def test_ruckig_and_the_closed_form_give_the_same_laws_for_every_robot(name):
    """Phases in seconds; jerk to position relative to their largest value."""
    arm = load_robot(name)
    start, end = random_motions(arm, 30)
    rows = np.arange(30)
    own, other = (MotionPaths(arm, start, end, engines=Engines(time_laws=e)) for e in ("closed_form", "ruckig"))
    peaks = own.peak_velocities(SPEED_LIMITS)
    found, expected = own.laws(peaks, rows), other.laws(peaks, rows)
    assert np.abs(found.duration_s - expected.duration_s).max() <= 1e-12
    for field in ("jerk", "acceleration", "velocity", "position"):
        one, other = getattr(found, field), getattr(expected, field)
        assert (np.abs(one - other) <= 1e-12 * np.abs(other).max(axis=-1, keepdims=True)).all(), field


def test_engines_change_rounding_alone(robot):
    start, end = random_motions(robot, 40)
    paths = [MotionPaths(robot, start, end, engines=engines) for engines in (Engines(), Engines("pinocchio", "ruckig"))]
    own, other = (one.simulate(SPEED_LIMITS) for one in paths)
    part = paths[1].subset(slice(3, 5)).simulate(SPEED_LIMITS)
    for field in dataclasses.fields(own):
        values = getattr(other, field.name)
        assert getattr(own, field.name) == pytest.approx(values, rel=1e-9, abs=1e-9 * np.abs(values).max())
        assert np.array_equal(getattr(part, field.name), values[3:5])  # a part of them keeps its engines
    assert not np.array_equal(own.energy_j, other.energy_j)
