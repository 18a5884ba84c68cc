"""The common parameter vector: what it makes of drives, and its derivatives."""

from dataclasses import replace

import numpy as np
import pytest

from robojoule.calibration.log_model import log_parameters
from robojoule.calibration.parameters import (
    IDENTITY,
    LOG_RATIO,
    LOG_RECIPROCAL,
    RECIPROCAL,
    ParameterGroup,
    ParameterVector,
    group,
    share_of_range,
)
from robojoule.calibration.run_model import TYPICAL_LOAD_FRICTION, expected_entries, run_parameters
from robojoule.motion.path_integrals import INERTIAL
from robojoule.robots import load_robot

TRANSFORMS = {
    "identity": IDENTITY,
    "reciprocal": RECIPROCAL,
    "log ratio": LOG_RATIO,
    "log reciprocal": LOG_RECIPROCAL,
    "share of a logarithmic range": share_of_range(0.02, 0.7),
    "share of a range from 0": share_of_range(0.0, 110.0),
}


@pytest.fixture(scope="module")
def robot():
    return load_robot("kuka_kr16_r2010_2")


@pytest.mark.parametrize("transform", TRANSFORMS.values(), ids=TRANSFORMS)
def test_transforms_are_inverted_and_differentiated(transform):
    x = np.array([0.2, 0.5, 0.9])
    np.testing.assert_allclose(transform.inverse(transform.value(x)), x, rtol=1e-12)
    numeric = (transform.value(x + 1e-6) - transform.value(x - 1e-6)) / 2e-6
    np.testing.assert_allclose(transform.slope(x), numeric, rtol=1e-8)


def test_ranges_are_shared_logarithmically_unless_they_begin_at_0():
    assert share_of_range(1.0, 100.0).value(np.array([0.0, 0.5, 1.0])) == pytest.approx([1.0, 10.0, 100.0])
    assert share_of_range(0.0, 100.0).value(np.array([0.0, 0.5, 1.0])) == pytest.approx([0.0, 50.0, 100.0])


@pytest.mark.parametrize("kind", ["log", "runs"])
def test_the_start_is_the_entry(robot, kind):
    vector = log_parameters(robot) if kind == "log" else run_parameters(robot.drives, np.zeros((60, 3)))
    drives = vector.drives(vector.start)
    for part in vector.groups:
        known = getattr(robot.drives, part.figure) if part.figure != "load_friction" else TYPICAL_LOAD_FRICTION
        np.testing.assert_allclose(getattr(drives, part.figure), np.broadcast_to(known, np.shape(part.unit)))
    assert drives.filter_time_s == robot.drives.filter_time_s
    assert vector.size == {"log": 4 + 3 * 6, "runs": 3 + 5 * 6 + 3}[kind]
    assert vector.prior().mean is not vector.start


def test_every_entry_has_its_key_in_a_robot_file(robot):
    vector = log_parameters(robot)
    drives = robot.file.model_dump()["drives"]
    for key, value in zip(vector.keys(robot.joint_names), vector.figures(vector.start), strict=True):
        here = drives
        for part in key:
            here = here[part]
        assert here == pytest.approx(value, rel=1e-12)


def test_log_ratios_scale_figures_and_a_figure_of_0_stays(robot):
    vector = run_parameters(robot.drives, np.zeros((60, 0)))
    x = vector.start.copy()
    x[vector.part("coulomb_nm")] = np.log([1.0, 2.0, 1.0, 1.0, 0.5, 1.0])
    x[vector.part("inverter_efficiency")] = 0.01  # a log-ratio of the reciprocal
    drives = vector.drives(x)
    np.testing.assert_allclose(drives.coulomb_nm, robot.drives.coulomb_nm * [1.0, 2.0, 1.0, 1.0, 0.5, 1.0])
    assert drives.inverter_efficiency == pytest.approx(robot.drives.inverter_efficiency * np.exp(-0.01))
    none = replace(robot.drives, base_power_w=0.0)
    still = group(none, "base_power_w", LOG_RATIO, 0.1, unit=0.0)
    assert ParameterVector(none, (still,)).drives(np.array([3.0])).base_power_w == 0.0


def test_joints_in_step_share_an_entry(robot):
    def of(name, joints):
        return ParameterGroup(
            name,
            "coulomb_nm",
            share_of_range(0.01, 1.0),
            robot.effort_nm[list(joints)],
            joints,
            *np.array([[0.5], [1.0], [0.0], [1.0]]),
        )

    vector = ParameterVector(robot.drives, (of("main", (0, 1, 2)), of("wrist", (3, 4, 5))))
    drives = vector.drives(np.array([0.5, 1.0]))
    np.testing.assert_allclose(drives.coulomb_nm, robot.effort_nm * [0.1, 0.1, 0.1, 1.0, 1.0, 1.0])
    assert {name: value.item() for name, value in vector.values(np.zeros(2)).items()} == {"main": 0.01, "wrist": 0.01}


def test_derivatives_after_figures_become_those_after_entries(robot):
    vector = run_parameters(robot.drives, np.zeros((60, 2)))
    x = 0.3 * np.random.default_rng(2).standard_normal(vector.size)
    gradient = {part.figure: np.ones((4, *np.shape(part.unit))) for part in vector.groups}
    chained = vector.chain(gradient | {INERTIAL: np.full((4, 2), 7.0)}, x)
    assert chained.shape == (4, vector.size)
    for entry in range(vector.size - 2):
        step = np.zeros(vector.size)
        step[entry] = 1e-6
        numeric = (vector.figures(x + step) - vector.figures(x - step))[entry] / 2e-6
        assert chained[:, entry] == pytest.approx(numeric, rel=1e-6)
    assert (chained[:, vector.part(INERTIAL)] == 7.0).all()


def test_expected_figures_exceed_medians_of_a_log_normal(robot):
    vector = run_parameters(robot.drives, np.zeros((60, 2)))
    draws = np.random.default_rng(3).normal(0.0, 0.3, 200_000)
    x = expected_entries(vector, vector.start, np.diag(np.full(vector.size, 0.09)))
    assert np.exp(x[vector.part("coulomb_nm")]) == pytest.approx(np.exp(draws).mean(), rel=5e-3)
    assert (x[vector.part(INERTIAL)] == 0.0).all()
