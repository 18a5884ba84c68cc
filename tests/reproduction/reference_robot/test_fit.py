"""The fit of the reference robot: it finds, it is reproducible, and its result is what the catalog holds."""

import numpy as np
import pytest

from reproduction.reference_robot.fit import FitMotions, fitted_robot, fitted_values, misses
from reproduction.reference_robot.setup import FOLDER, fit_setup
from robojoule.documents import read_document
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload


@pytest.fixture(scope="module")
def fitted():
    setup = fit_setup()
    robot = load_robot(setup.robot, Payload(setup.payload_kg))
    return setup, robot, FitMotions(setup, robot), read_document(FOLDER / "fitted.yaml")


@pytest.fixture(scope="module")
def few():
    """The same search on few trees, with few first points and generations."""
    setup = fit_setup()
    return setup.model_copy(
        update={
            "trees": setup.trees.model_copy(update={"count": 12}),
            "optimiser": setup.optimiser.model_copy(update={"trials": 4, "population": 5, "generations": 6}),
        }
    )


def cost(motions, robot, setup):
    return sum(miss**2 for miss in misses(motions.figures(robot), setup).values())


def test_the_catalog_holds_the_fitted_drives(fitted):
    setup, robot, _, document = fitted
    again = fitted_robot(robot, setup, document["parameters"])
    assert robot.peak_effort_nm == pytest.approx(again.peak_effort_nm, rel=1e-5)
    for name in ("gear_ratio", "rotor_inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad", "copper_w_per_nm2"):
        assert getattr(robot.drives, name) == pytest.approx(getattr(again.drives, name), rel=1e-5)
    shared = ("base_power_w", "drive_active_power_w", "inverter_efficiency", "filter_time_s", "least_cruise_share")
    for name in (*shared, "torque_use", "torque_floor"):
        assert getattr(robot.drives, name) == pytest.approx(getattr(again.drives, name), rel=1e-5)


def test_the_catalog_has_the_written_figures_on_the_fits_trees(fitted):
    """Regression values beside the bounds: what misses them is named in the file and in the docs."""
    setup, robot, motions, document = fitted
    figures = motions.figures(robot)
    assert {name: round(value, 2) for name, value in figures.items()} == pytest.approx(document["figures"], abs=0.02)
    missed = {name for name, miss in misses(figures, setup).items() if abs(miss) > 1e-3}
    assert missed == {name for name, miss in document["misses"].items() if abs(miss) > 1e-3}
    page = (FOLDER.parents[1] / "docs" / "energy-model.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in page for name in missed)


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
    setup, robot, motions, _ = fitted
    at_prior = fitted_robot(robot, setup, {name: item.prior for name, item in setup.parameters.items()})
    assert cost(motions, robot, setup) < 0.1 * cost(motions, at_prior, setup)


def test_the_search_starts_off_the_solution_and_improves_the_same_way_twice(few):
    values, (at_prior, best_first, result) = fitted_values(few)
    assert at_prior >= best_first
    assert result < best_first
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
