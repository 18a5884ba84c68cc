import numpy as np
import pytest
from scipy.optimize import minimize

from robojoule.robots import load_robot
from robojoule.robots.collision import (
    FLOOR,
    TOOL,
    CollisionModel,
    derive_capsules,
    path_points_rad,
    segment_distances_m,
)
from robojoule.robots.robot import Payload, Robot

DEG = np.pi / 180


@pytest.fixture(scope="module")
def robot():
    return load_robot("kuka_kr16_r2010_2", Payload(10.0))


@pytest.fixture(scope="module")
def model(robot):
    return CollisionModel(robot)


# id: first segment, second segment, distance
SEGMENTS = {
    "crossing": ([[-1, 0, 0], [1, 0, 0]], [[0, -1, 0], [0, 1, 0]], 0.0),
    "skew": ([[-1, 0, 0], [1, 0, 0]], [[0, -1, 2], [0, 1, 2]], 2.0),
    "parallel-overlapping": ([[0, 0, 0], [2, 0, 0]], [[1, 1, 0], [5, 1, 0]], 1.0),
    "parallel-apart": ([[0, 0, 0], [2, 0, 0]], [[5, 4, 0], [9, 4, 0]], 5.0),
    "antiparallel": ([[0, 0, 0], [2, 0, 0]], [[9, 4, 0], [5, 4, 0]], 5.0),
    "in-line": ([[0, 0, 0], [1, 0, 0]], [[3, 0, 0], [4, 0, 0]], 2.0),
    "same": ([[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0]], 0.0),
    "end-to-middle": ([[0, 1, 0], [0, 3, 0]], [[-1, 0, 0], [1, 0, 0]], 1.0),
    "end-to-end": ([[0, 0, 0], [1, 0, 0]], [[2, 1, 0], [3, 5, 0]], np.sqrt(2)),
    "point-and-segment": ([[0, 2, 0], [0, 2, 0]], [[-1, 0, 0], [1, 0, 0]], 2.0),
    "two-points": ([[0, 0, 0], [0, 0, 0]], [[3, 4, 0], [3, 4, 0]], 5.0),
    "shared-end": ([[0, 0, 0], [1, 0, 0]], [[1, 0, 0], [1, 1, 0]], 0.0),
}


@pytest.mark.parametrize("case", SEGMENTS)
def test_segment_distance_of_known_cases(case):
    first, second, expected = SEGMENTS[case]
    a, b = np.array(first, dtype=float), np.array(second, dtype=float)
    for p, q in ((a, b), (b, a), (a[::-1], b), (a, b[::-1])):
        assert segment_distances_m(p[0], p[1], q[0], q[1]) == pytest.approx(expected, abs=1e-12)


def test_segment_distance_against_minimisation():
    rng = np.random.default_rng(0)
    a0, a1, b0, b1 = rng.normal(size=(4, 30, 3))
    fast = segment_distances_m(a0, a1, b0, b1)
    for row in range(30):

        def squared(x, row=row):
            gap = a0[row] + x[0] * (a1 - a0)[row] - b0[row] - x[1] * (b1 - b0)[row]
            return gap @ gap

        best = minimize(squared, (0.5, 0.5), bounds=[(0, 1)] * 2, tol=1e-12).fun
        assert fast[row] == pytest.approx(np.sqrt(best), abs=1e-5)


def test_segment_distance_never_above_dense_sampling():
    rng = np.random.default_rng(1)
    a0, a1, b0, b1 = rng.uniform(-1, 1, size=(4, 40, 3))
    grid = np.linspace(0, 1, 60)[:, None, None]
    gaps = (a0 + grid * (a1 - a0))[:, None] - (b0 + grid * (b1 - b0))[None]
    sampled = np.linalg.norm(gaps, axis=-1).min(axis=(0, 1))
    fast = segment_distances_m(a0, a1, b0, b1)
    assert np.all(fast <= sampled + 1e-12)
    assert np.all(sampled - fast < 0.08)  # two grid steps of segments up to 3.5 m


def test_kinematics_against_pinocchio(robot, model):
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(2)
    data, mechanism = robot.model.createData(), robot.mechanism
    for q in rng.uniform(robot.lower_rad, robot.upper_rad, (20, 6)):
        segments = model.segments_m(q)[:, :, 0]
        pin.forwardKinematics(robot.model, data, q)
        for name, ends in zip(model.names, segments, strict=True):
            if name == TOOL:
                tool = data.oMi[mechanism.tool_body] * pin.SE3(mechanism.tool.rotation, mechanism.tool.origin_m)
                expected = [tool.act(np.array(robot.payload.com_m))] * 2
            else:
                body, at = mechanism.anchors[name]
                capsule = robot.file.capsules[name][0]
                expected = [data.oMi[body].act(at.at(p)) for p in (capsule.from_m, capsule.to_m)]
            np.testing.assert_allclose(ends, expected, atol=1e-12)


def test_clearances_against_coal(robot, model):
    coal = pytest.importorskip("coal")
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(3)
    q = rng.uniform(robot.lower_rad, robot.upper_rad, (30, 6))
    clearances, segments = model.clearances_m(q), model.segments_m(q)

    def shape(index, row):
        ends = segments[index, :, row]
        length = float(np.linalg.norm(ends[1] - ends[0]))
        turn = pin.Quaternion.FromTwoVectors(np.array([0, 0, 1.0]), (ends[1] - ends[0]) / length).matrix()
        return coal.Capsule(model._radii_m[index], length), coal.Transform3s(turn, ends.mean(axis=0))

    for row in range(len(q)):
        for column, (first, second) in enumerate(model.pairs):
            if TOOL in (model.names[first], model.names[second]):
                continue
            result = coal.DistanceResult()
            a, b = shape(first, row), shape(second, row)
            coal.distance(a[0], a[1], b[0], b[1], coal.DistanceRequest(), result)
            if result.min_distance > 0:
                assert clearances[row, column] == pytest.approx(result.min_distance, abs=1e-4)
            else:
                assert clearances[row, column] <= 1e-4


# id: configuration in degrees, what touches what most deeply (None: free)
POSES = {
    "home": ([0, -90, 90, 0, 0, 0], None),
    "home-turned": ([120, -90, 90, 0, 0, 0], None),
    "stretched-forward": ([0, 0, 0, 0, 0, 0], None),
    "stretched-up": ([0, -90, 0, 0, 0, 0], None),
    "folded": ([0, -90, 175, 0, 0, 0], None),
    "upper-arm-into-floor": ([0, 25, -115, 0, 115, 0], ("link_2", FLOOR)),
    "forearm-into-floor": ([0, -20, 145, 0, 130, 0], ("link_4", FLOOR)),
    "payload-into-floor": ([0, 20, -15, 0, 85, 0], (TOOL, FLOOR)),
    "payload-into-column": ([0, -125, -135, 0, -120, 0], ("base_link", TOOL)),
    "payload-into-shoulder": ([0, -135, 170, 0, 35, 0], ("link_1", TOOL)),
    "payload-into-upper-arm": ([0, -105, 160, 0, 125, 0], ("link_2", TOOL)),
    "payload-into-forearm": ([0, -90, 90, 0, 130, 0], ("link_4", TOOL)),
}


@pytest.mark.parametrize("case", POSES)
def test_known_poses(model, case):
    degrees, touched = POSES[case]
    assert model.first_collision(np.array(degrees) * DEG) == touched
    assert model.collides(np.array(degrees) * DEG).tolist() == [touched is not None]


def test_home_is_well_clear(robot, model):
    assert model.clearances_m(robot.home_rad).min() > 0.04


def test_adjacent_links_are_exempt(model):
    checked = set(model.checks)
    for pair in (("base_link", "link_1"), ("link_1", "link_2"), ("link_2", "link_3"), ("link_6", TOOL)):
        assert pair not in checked
    assert set(model.exempt).isdisjoint(checked)


def test_what_matters_is_checked(model):
    checked = set(model.checks)
    for pair in (
        ("base_link", "link_4"),
        ("base_link", "link_6"),
        ("base_link", TOOL),
        ("link_2", "link_6"),
        ("link_2", TOOL),
        ("link_4", TOOL),
        ("link_2", FLOOR),
        ("link_4", FLOOR),
        (TOOL, FLOOR),
    ):
        assert pair in checked


def test_turning_joint_1_changes_nothing(robot, model):
    rng = np.random.default_rng(4)
    q = rng.uniform(robot.lower_rad, robot.upper_rad, (50, 6))
    turned = q.copy()
    turned[:, 0] = 0.3
    np.testing.assert_allclose(model.clearances_m(q), model.clearances_m(turned), atol=1e-9)


def test_heavier_payload_is_larger():
    def touching(mass):
        robot = load_robot("kuka_kr16_r2010_2", Payload(mass))
        model = CollisionModel(robot)
        q = np.random.default_rng(5).uniform(robot.lower_rad, robot.upper_rad, (2000, 6))
        return model.collides(q)

    without, with_16 = touching(0.0), touching(16.0)
    assert np.all(with_16 >= without)
    assert with_16.sum() > without.sum()


def test_no_payload_has_no_capsule():
    assert TOOL not in CollisionModel(load_robot("kuka_kr16_r2010_2")).names


@pytest.mark.parametrize(
    ("end", "count"),
    [
        pytest.param([0, 0], 2, id="zero-length"),
        pytest.param([2 * DEG, 0], 2, id="one-step"),
        pytest.param([2.01 * DEG, 0], 3, id="a-little-more"),
        pytest.param([-10 * DEG, 90 * DEG], 46, id="largest-joint-counts"),
    ],
)
def test_path_is_checked_every_two_degrees(end, count):
    points = path_points_rad([0, 0], end)
    assert len(points) == count
    np.testing.assert_array_equal(points[[0, -1]], [[0, 0], end])
    assert np.abs(np.diff(points, axis=0)).max() <= 2 * DEG + 1e-12


def test_path_between_free_poses_may_collide(model):
    start, end = np.array([0, -35, -75, 0, -65, 0]) * DEG, np.array([0, -35, 165, 0, 0, 0]) * DEG
    assert not model.collides([start, end]).any()
    assert model.path_collides(start, end)
    assert not model.path_collides(start, start)


def test_catalog_capsules_follow_the_rule(robot):
    derived = derive_capsules(robot.file)
    assert derived == robot.file.capsules
    radii = [derived[link][0].radius_m for link in derived]
    assert radii == sorted(radii, reverse=True)
    # reach 0.98 + 0.15 + 0.86 + 0.153 m
    assert radii[0] == pytest.approx(0.075 * 2.143, abs=1e-3)
    assert radii[-1] == pytest.approx(0.04 * 2.143, abs=1e-3)


def test_robot_file_without_capsules_gets_derived_ones(robot, model):
    bare = Robot(robot.file.model_copy(update={"capsules": {}}), robot.payload)
    q = np.random.default_rng(6).uniform(robot.lower_rad, robot.upper_rad, (20, 6))
    np.testing.assert_array_equal(CollisionModel(bare).clearances_m(q), model.clearances_m(q))


def test_single_joint_arm_gets_capsules(robot):
    file = robot.file
    last = file.moving_joints[0].child
    short = file.model_copy(
        update={
            "joints": file.joints[:1],
            "tool": file.tool.model_copy(update={"parent": last, "origin_xyz_m": (0.5, 0.0, 0.0)}),
            "home_rad": [0.0],
            "capsules": {},
        }
    )
    capsules = derive_capsules(short)
    assert list(capsules) == [last]
    assert capsules[last][0].to_m == (0.5, 0.0, 0.0)
    assert capsules[last][0].radius_m == pytest.approx(0.02)
    # It turns in the plane of the floor: nothing is left to check.
    assert CollisionModel(Robot(short)).exempt == ((last, FLOOR),)
    assert not CollisionModel(Robot(short)).collides([[0.0], [1.0]]).any()
