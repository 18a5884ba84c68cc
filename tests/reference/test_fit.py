"""The fit of the reference robot: reproducible, and what the catalog holds."""

import numpy as np
import pytest

from robojoule.documents import read_document
from robojoule.reference.fit import FOLDER, figures_of, fit, fit_setup, fit_trees, residuals, set_drives
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload


@pytest.fixture(scope="module")
def fitted():
    setup = fit_setup()
    robot = load_robot(setup.robot, Payload(setup.payload_kg))
    return setup, robot, fit_trees(setup, robot), read_document(FOLDER / "fitted.yaml")


def test_the_catalog_holds_the_fitted_drives(fitted):
    setup, robot, _, document = fitted
    again = load_robot(setup.robot, Payload(setup.payload_kg))
    set_drives(again, setup, document["parameters"])
    for name in ("gear_ratio", "rotor_inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad", "copper_w_per_nm2"):
        assert getattr(robot.drives, name) == pytest.approx(getattr(again.drives, name), rel=1e-5)
    for name in ("base_power_w", "drive_active_power_w", "inverter_efficiency", "filter_time_s", "torque_use"):
        assert getattr(robot.drives, name) == pytest.approx(getattr(again.drives, name), rel=1e-5)


def test_the_catalog_meets_the_aims_on_the_fits_trees(fitted):
    """Regression values beside it: the figures as the fit wrote them."""
    setup, robot, motions, document = fitted
    figures, nearest = figures_of(robot, motions)
    assert {name: round(value, 2) for name, value in figures.items()} == pytest.approx(document["figures"], abs=0.02)
    assert np.abs(residuals(figures, nearest, setup)).max() < 1e-3


def test_values_stay_within_their_ranges(fitted):
    setup, _, _, document = fitted
    for name, (low, high) in setup.ranges.items():
        assert low <= document["parameters"][name] <= high


def test_the_fit_is_reproducible(fitted):
    setup, _, _, document = fitted
    few = setup.model_copy(update={"optimiser": setup.optimiser.model_copy(update={"iterations": 2})})
    assert fit(few) == document["parameters"]


def test_a_worse_model_has_residuals(fitted):
    setup, _, motions, document = fitted
    robot = load_robot(setup.robot, Payload(setup.payload_kg))
    set_drives(robot, setup, document["parameters"] | {"viscous_main": 2.0, "drive_active_power_w": 0.0})
    figures, nearest = figures_of(robot, motions)
    assert np.abs(residuals(figures, nearest, setup)).max() > 1.0
