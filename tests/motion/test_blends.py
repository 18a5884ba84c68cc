"""Blended motions: geometry, the controller's limits, energies against dense integration, optimal time."""

from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import linprog

from robojoule.errors import InputError
from robojoule.motion.blend_samples import sampled
from robojoule.motion.blends import BlendedPaths
from robojoule.motion.corners import Chain
from robojoule.motion.dynamics import inverse_dynamics
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import load_robot
from robojoule.robots.drives import drive_powers, mains_energy_j
from robojoule.robots.robot import Payload
from tests.calibration.machines import joint_controller
from tests.core_cases import kr16
from tests.motion.chains import ROBOTS, random_chain, random_chains, random_points

LIMITS = np.array([1.0, 0.6, 0.25])


@pytest.fixture(scope="module", params=ROBOTS)
def blended(request):
    robot = load_robot(request.param, Payload(3.0))
    return BlendedPaths(robot, random_chains(robot))


@pytest.mark.parametrize("limit", LIMITS)
def test_velocities_and_torques_keep_within_their_limits(blended, limit):
    """Every speed limit, random paths: sampled velocities, and torques by inverse dynamics of their own."""
    robot, drives = blended.robot, blended.robot.drives
    moves = blended.move_limits([limit])[:, 0]
    for motion in range(blended.motions):
        samples = sampled(blended, motion, moves, rate_hz=1000.0)
        assert (np.abs(samples.velocity_rad_s) <= limit * robot.velocity_rad_s * (1.0 + 1e-9)).all()
        states = samples.position_rad, samples.velocity_rad_s, samples.acceleration_rad_s2
        load = inverse_dynamics(robot, *states) + drives.reflected_inertia_kg_m2 * states[2]
        turning = np.abs(states[1]) > 1e-6
        friction = drives.coulomb_nm * np.sign(states[1]) + drives.viscous_nm_s_per_rad * states[1]
        assert np.allclose((load + friction)[turning], samples.torque_nm[turning], rtol=1e-6, atol=1e-4)
        standing = inverse_dynamics(robot, states[0], 0.0 * states[1], 0.0 * states[2])
        steady = np.abs(standing) + drives.coulomb_nm + drives.viscous_nm_s_per_rad * np.abs(states[1])
        allowed = np.maximum(
            drives.torque_use * robot.peak_effort_nm, steady + drives.torque_floor * robot.peak_effort_nm
        )
        allowed = np.minimum(allowed, robot.peak_effort_nm)
        assert (np.abs(samples.torque_nm) <= 1.02 * allowed).all()


def test_positions_are_what_their_velocities_give(blended):
    """The time law is continuous, and its derivatives are those that torques are computed from."""
    for motion in range(blended.motions):
        samples = sampled(blended, motion, blended.move_limits([1.0])[:, 0], rate_hz=4000.0)
        step = np.diff(samples.time_s)[:, None]
        for path, rate in (("position_rad", "velocity_rad_s"), ("velocity_rad_s", "acceleration_rad_s2")):
            value, slope = getattr(samples, path), getattr(samples, rate)
            change = (slope[1:] + slope[:-1]) / 2.0 * step
            assert np.abs(np.diff(value, axis=0) - change).max() <= 8e-5 * max(1.0, np.abs(slope).max())
        assert samples.velocity_rad_s[[0, -1]] == pytest.approx(0.0, abs=1e-9)
        assert samples.position_rad[[0, -1]] == pytest.approx(blended.chains[motion].points_rad[[0, -1]], abs=1e-9)


def test_energies_are_those_of_dense_integration(blended):
    robot, runs = blended.robot, blended.simulate([0.6])
    for motion in range(blended.motions):
        samples = sampled(blended, motion, blended.move_limits([0.6])[:, 0], rate_hz=20000.0)
        q, qd, qdd = samples.position_rad, samples.velocity_rad_s, samples.acceleration_rad_s2
        load = inverse_dynamics(robot, q, qd, qdd) + robot.drives.reflected_inertia_kg_m2 * qdd
        power = drive_powers(robot.drives, np.sign(qd), qd, load)
        drawn, bus, squared = (
            np.trapezoid(values, samples.time_s, axis=0)
            for values in (np.maximum(power.bus_w, 0.0), power.bus_w, power.torque_nm**2)
        )
        duration = samples.time_s[-1]
        assert runs.duration_s[motion, 0] == pytest.approx(duration, rel=1e-9)
        assert runs.energy_j[motion, 0] == pytest.approx(mains_energy_j(robot.drives, duration, drawn, bus), rel=2e-4)
        assert runs.torque_square_integral_nm2_s[motion, 0] == pytest.approx(squared, rel=2e-3, abs=1.0)
        assert runs.peak_power_w[motion, 0] == pytest.approx(samples.power_w.max(), rel=0.02)
    parts = runs.potential_j + runs.friction_j + runs.copper_j + runs.braking_j + runs.inverter_j
    assert parts + runs.base_j + runs.drive_active_j == pytest.approx(runs.energy_j, rel=1e-9)


def test_narrow_zones_come_to_the_fine_motions():
    """The corner's velocity falls with the root of its length, and so does what it takes off the duration."""
    robot = kr16()
    points = random_points(robot, 5, seed=3)
    fine = MotionPaths(robot, points[:-1], points[1:]).simulate(LIMITS)
    missing = []
    for radius in (1e-3, 1e-5, 1e-7):
        runs = BlendedPaths(robot, [Chain(points, np.full(4, radius), np.full(4, 0.5))]).simulate(LIMITS)
        missing.append(
            [
                1.0 - runs.duration_s[0] / fine.duration_s.sum(axis=0),
                1.0 - runs.energy_j[0] / fine.energy_j.sum(axis=0),
            ]
        )
    missing = np.array(missing)
    assert (missing > 0.0).all()
    assert (missing[2] < 2e-3).all()
    assert (missing[1] < 0.3 * missing[0]).all()


def test_motions_of_one_leg_are_those_of_single_lines():
    robot = kr16()
    points = random_points(robot, 6, seed=5)
    lines = MotionPaths(robot, points[:-1], points[1:])
    chains = [Chain.straight(*ends) for ends in pairwise(points)]
    chains.append(random_chain(robot, 4, seed=8))
    blended = BlendedPaths(robot, chains)
    one, other = lines.simulate(LIMITS), blended.simulate(LIMITS)
    for field in fields(one):
        assert np.array_equal(getattr(one, field.name), getattr(other, field.name)[:-1]), field.name
    assert np.array_equal(lines.durations(LIMITS), blended.durations(LIMITS)[:-1])
    assert np.array_equal(lines.fastest_speed_limits(), blended.fastest_speed_limits()[:-1])
    assert blended.durations(LIMITS) == pytest.approx(other.duration_s, rel=1e-12)
    part = blended.subset(np.array([6, 2])).simulate(LIMITS)
    assert part.energy_j == pytest.approx(other.energy_j[[6, 2]], rel=1e-12)
    assert np.array_equal(blended.idle_power_end_w[:-1], lines.idle_power_end_w)


def test_speed_limits_for_durations_are_the_inverse_of_durations(blended):
    wanted = blended.durations([0.37])[:, 0]
    limits = blended.speed_limits_for_durations(wanted)
    assert blended.durations(limits[:, None])[:, 0] == pytest.approx(wanted, rel=1e-9)
    top = blended.fastest_speed_limits()
    assert blended.durations(top[:, None])[:, 0] == pytest.approx(blended.durations([1.0])[:, 0], rel=1e-6)
    with pytest.raises(InputError, match="cannot take"):
        blended.speed_limits_for_durations(0.5 * blended.minimum_durations())


def test_higher_speed_limits_take_no_longer(blended):
    durations = blended.durations(np.linspace(0.05, 1.0, 60))
    assert (np.diff(durations, axis=1) <= 1e-9).all()


def test_moves_keep_their_own_range_of_speed_limits():
    robot = kr16()
    chain = Chain(random_points(robot, 3, seed=2), np.full(2, 0.05), np.full(2, 0.5))
    low, high = np.array([0.1, 0.5, 0.2]), np.array([1.0, 0.5, 0.7])
    blended = BlendedPaths(robot, [chain], (low, high))
    assert blended.move_limits([0.9, 0.6, 0.15]).T.tolist() == [[0.9, 0.5, 0.7], [0.6, 0.5, 0.6], [0.15, 0.5, 0.2]]
    free = BlendedPaths(robot, [chain])
    assert blended.durations([0.6]) == pytest.approx(free.simulate_moves(np.array([[0.6], [0.5], [0.6]])).duration_s)
    velocities = blended.timing.velocities(np.array([[1.0], [0.5], [0.7]]))
    assert (velocities.peak[:, 0] <= np.array([1.0, 0.5, 0.7]) * (1.0 + 1e-12)).all()
    assert velocities.corner.max() <= 0.5 * (1.0 + 1e-12)


def test_the_duration_is_near_the_least_that_any_time_law_has():
    """Against optimal time scaling on a grid, a linear program in the squared path velocity.

    It knows no jerk, no least cruise and no constant speed in corners, so it must be faster, but not by far.
    """
    robot = kr16(5.0)
    robot = robot.variant(drives=replace(robot.drives, viscous_nm_s_per_rad=0.0 * robot.drives.viscous_nm_s_per_rad))
    shares = []
    for seed in range(6):
        chain = Chain(random_points(robot, 4, seed, sizes=[1.0]), np.full(3, 0.15), np.full(3, 0.5))
        blended = BlendedPaths(robot, [chain])
        shares.append(least_duration_s(blended) / blended.durations([1.0])[0, 0])
    assert max(shares) <= 1.0
    assert min(shares) > 0.75, shares


def least_duration_s(blended, cells=120):
    """Least duration of the first motion within velocity and usable torque, from the fastest squared velocities."""
    corners, robot, drives = blended.corners, blended.robot, blended.robot.drives
    parts = []  # start of each part, its length [s], and what gives position, slope and curvature there
    cuts, place = corners.cuts_s, 0.0
    for leg, length in enumerate(corners.length_s):
        a, b = cuts[leg, 0] / length, 1.0 - cuts[leg, 1] / length
        parts.append((place, (b - a) * length, blended.legs.path, leg, a, (b - a), length))
        place += (b - a) * length
        for piece in np.flatnonzero(corners.before[corners.corner] == leg):
            width = 2.0 * corners.half_s[corners.corner[piece]] * corners.share[piece]
            parts.append((place, width, corners.pieces, piece, 0.0, 1.0, width))
            place += width
    step = place / cells
    middles = (np.arange(cells) + 0.5) * step
    states = np.empty((3, cells, robot.joint_count))
    for k, at in enumerate(middles):
        start, width, path, row, a, share, scale = next(p for p in parts if at <= p[0] + p[1] + 1e-12)
        s = np.array([a + share * (at - start) / width])
        rows = slice(row, row + 1)
        states[0, k] = path.positions_rad(rows, s)[:, 0, 0]
        states[1, k] = path.slopes_rad(rows, s)[0, :, 0] / scale
        states[2, k] = path.curvatures_rad(rows, s)[0, :, 0] / scale**2
    q, slope, bend = states
    none = np.zeros_like(q)
    gravity = inverse_dynamics(robot, q, none, none)
    along = inverse_dynamics(robot, q, none, slope) - gravity + drives.reflected_inertia_kg_m2 * slope
    across = inverse_dynamics(robot, q, slope, bend) - gravity + drives.reflected_inertia_kg_m2 * bend
    standing = gravity + drives.coulomb_nm * np.sign(slope)
    peak = robot.peak_effort_nm
    left = np.minimum(np.maximum(drives.torque_use * peak, np.abs(standing) + drives.torque_floor * peak), peak)
    rows, bounds = [], []
    for k in range(cells):  # b at both ends of a cell: acceleration (b1 - b0) / 2 step, squared velocity (b0 + b1) / 2
        for sign in (1.0, -1.0):
            for j in range(robot.joint_count):
                row = np.zeros(cells + 1)
                row[k : k + 2] = sign * (across[k, j] / 2.0 + along[k, j] / (2.0 * step) * np.array([-1.0, 1.0]))
                rows.append(row)
                bounds.append(left[k, j] - sign * standing[k, j])
    top = [(0.0, 0.0), *[(0.0, 1.0)] * (cells - 1), (0.0, 0.0)]
    found = linprog(-np.ones(cells + 1), A_ub=np.array(rows), b_ub=np.array(bounds), bounds=top)
    assert found.status == 0
    root = np.sqrt(found.x)
    return float((2.0 * step / (root[:-1] + root[1:])).sum())


def test_a_learnt_controller_blends_by_its_own_figures():
    robot = kr16()
    controller = joint_controller(robot, dead_s=0.1)
    learnt = robot.variant(controller=controller)
    points = random_points(robot, 4, seed=6)
    chain = Chain(points, np.full(3, 0.1), np.full(3, 0.5))
    blended = BlendedPaths(learnt, [chain, Chain.straight(points[0], points[1])])
    lines = MotionPaths(learnt, points[:1], points[1:2])
    assert blended.durations(LIMITS)[1] == pytest.approx(lines.durations(LIMITS)[0], rel=1e-12)
    runs = blended.simulate(LIMITS)
    assert runs.duration_s == pytest.approx(blended.durations(LIMITS), rel=1e-12)
    for limit in LIMITS:
        samples = sampled(blended, 0, blended.move_limits([limit])[:, 0], rate_hz=1000.0)
        assert (np.abs(samples.velocity_rad_s) <= limit * controller.velocity_rad_s * (1.0 + 1e-9)).all()
        assert samples.time_s[-1] + 0.1 == pytest.approx(blended.durations([limit])[0, 0])


def test_points_without_a_move_make_no_corner():
    robot = kr16()
    a, b, c = random_points(robot, 2, seed=1)
    plain = BlendedPaths(robot, [Chain(np.array([a, b, c]), np.array([0.05]), np.array([0.5]))])
    doubled = Chain(np.array([a, a, b, b, c]), np.array([0.2, 0.3, 0.05]), np.full(3, 0.5))
    blended = BlendedPaths(robot, [doubled, Chain(np.array([a, a, a]), np.array([0.1]), np.array([0.5]))])
    assert blended.durations(LIMITS)[0] == pytest.approx(plain.durations(LIMITS)[0], rel=1e-12)
    assert blended.moving.tolist() == [True, False]
    runs = blended.simulate(LIMITS)
    assert (runs.duration_s[1] == 0.0).all()
    assert (runs.energy_j[1] == 0.0).all()


def test_a_straight_point_does_not_slow_down():
    """A point on the line, with a zone: the motion is nearly that without it."""
    robot = kr16()
    a, c = random_points(robot, 1, seed=1)
    line = MotionPaths(robot, a, c).simulate([1.0, 0.4])
    via = BlendedPaths(robot, [Chain(np.array([a, (a + c) / 2.0, c]), np.array([0.05]), np.array([0.5]))])
    runs = via.simulate([1.0, 0.4])
    assert runs.duration_s[0] == pytest.approx(line.duration_s[0], rel=0.08)
    assert runs.energy_j[0] == pytest.approx(line.energy_j[0], rel=0.1)


def test_a_corner_that_the_arm_cannot_hold_is_named():
    robot = kr16()
    stretched = np.radians([0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    weak = robot.variant(peak_effort_nm=robot.peak_effort_nm * np.array([1.0, 0.2, 1.0, 1.0, 1.0, 1.0]))
    points = np.array([stretched - 0.1, stretched, stretched + 0.1])
    with pytest.raises(InputError, match="joint_2 of kuka_kr16_r2010_2 cannot move the arm"):
        BlendedPaths(weak, [Chain(points, np.array([0.1]), np.array([0.5]))]).durations([1.0])
