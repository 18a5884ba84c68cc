"""The fit of the reference robot: it finds, it is reproducible, and its result is what the catalog holds."""

import numpy as np
import pytest

from reproduction.reference_robot.fit import BOUNDS, FOLDER, fit_setup, fit_trees, fitted_values, misses, with_drives
from robojoule.documents import read_document
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload


@pytest.fixture(scope="module")
def fitted():
    setup = fit_setup()
    robot = load_robot(setup.robot, Payload(setup.payload_kg))
    return setup, robot, fit_trees(setup, robot), read_document(FOLDER / "fitted.yaml")


@pytest.fixture(scope="module")
def few():
    """The same search on few trees, with few first points and generations."""
    setup = fit_setup()
    return setup.model_copy(
        update={
            "trees": setup.trees.model_copy(update={"count": 20}),
            "optimiser": setup.optimiser.model_copy(update={"trials": 4, "population": 5, "generations": 6}),
        }
    )


def priors(setup):
    return {name: parameter.prior for name, parameter in setup.parameters.items()}


def test_every_fitted_figure_is_a_target():
    assert set(fit_setup().targets) | {"idle_power_home_w"} == set(BOUNDS)


def test_the_catalog_holds_the_fitted_drives(fitted):
    setup, robot, _, document = fitted
    again = with_drives(load_robot(setup.robot, Payload(setup.payload_kg)), setup, document["parameters"])
    for name in ("gear_ratio", "rotor_inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad", "copper_w_per_nm2"):
        assert getattr(robot.drives, name) == pytest.approx(getattr(again.drives, name), rel=1e-5)
    for name in ("base_power_w", "drive_active_power_w", "inverter_efficiency", "filter_time_s", "torque_use"):
        assert getattr(robot.drives, name) == pytest.approx(getattr(again.drives, name), rel=1e-5)


def test_the_catalog_meets_the_bounds_on_the_fits_trees(fitted):
    """Regression values beside it: the figures and the largest miss as the fit wrote them."""
    setup, robot, motions, document = fitted
    figures, outside = misses(robot, motions, setup)
    assert {name: round(value, 2) for name, value in figures.items()} == pytest.approx(document["figures"], abs=0.02)
    assert np.abs(outside).max() == pytest.approx(document["largest_miss"], abs=0.02)
    for name, (low, high) in BOUNDS.items():
        if name in setup.targets and setup.targets[name].set_of is None:
            assert low <= figures[name] <= high, name


def test_priors_and_fitted_values_lie_within_their_ranges(fitted):
    setup, _, _, document = fitted
    for name, parameter in setup.parameters.items():
        low, high = parameter.range
        assert low <= parameter.prior <= high
        assert low <= document["parameters"][name] <= high
        transform = parameter.transform
        assert transform.value(transform.inverse(parameter.prior)) == pytest.approx(parameter.prior)
        assert transform.value(np.array([0.0, 1.0])) == pytest.approx(parameter.range)


def test_the_fit_beats_its_prior(fitted):
    setup, _, motions, _ = fitted
    robot = load_robot(setup.robot, Payload(setup.payload_kg))
    _, found = misses(robot, motions, setup)
    _, at_prior = misses(with_drives(robot, setup, priors(setup)), motions, setup)
    assert (found**2).sum() < 0.1 * (at_prior**2).sum()


def test_the_search_starts_off_the_solution_and_improves_the_same_way_twice(few):
    values, (at_prior, best_first, result) = fitted_values(few)
    assert at_prior >= best_first
    assert result < 0.7 * best_first
    assert fitted_values(few) == (values, [at_prior, best_first, result])


def test_the_table_of_the_docs_is_that_of_the_fit(fitted):
    setup, _, _, document = fitted
    page = (FOLDER.parents[1] / "docs" / "energy-model.md").read_text(encoding="utf-8")
    rows = page.split("| parameter | unit | range | prior | fitted |")[1].split("\n\n")[0].splitlines()[2:]
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]
    assert [row[2:] for row in cells] == [
        [f"{low:g}-{high:g}", f"{parameter.prior:g}", f"{document['parameters'][name]:.3g}"]
        for name, parameter in setup.parameters.items()
        for low, high in [parameter.range]
    ]
