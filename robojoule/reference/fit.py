"""Fit the drive parameters of the reference robot to published figures: `python -m robojoule.reference.fit`.

Motor constants, friction, inverter efficiency and standby of this robot are published nowhere. They are fitted here,
within stated plausible ranges (`targets.yaml`), so that simulated trees show the published power level and profiles
of the published shape. The search (least squares) is seeded; its result goes into the catalog.
"""

from __future__ import annotations

import dataclasses
import json
from functools import cache
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from robojoule.documents import Document, load, write_document
from robojoule.drive import Array
from robojoule.operations.generate import generate_configurations
from robojoule.reference.figures import energy_model_figures, example_deviations
from robojoule.robots import catalog_path, load_robot
from robojoule.robots.collision import CollisionModel
from robojoule.robots.robot import Payload, Robot
from robojoule.simulation import MotionPaths
from robojoule.timing import Index

FOLDER = Path(__file__).parent
SPEED_LIMITS = np.arange(1, 11) / 10.0
JOINT_FIGURES = ("rotor_inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad", "copper_w_per_nm2")
SHARED_FIGURES = ("filter_time_s", "inverter_efficiency", "drive_active_power_w")
Range = tuple[float, float]


class Target(Document):
    """Interval to be met, and the scale of a miss."""

    aim: Range
    scale: Annotated[float, Field(gt=0)] = 1.0


class Trees(Document):
    """The fit's own trees."""

    seed: int
    count: int
    points: int
    budget_rad: Range
    use_whole_budget: bool


class Optimiser(Document):
    """Least squares from several starts."""

    seed: int
    starts: int
    iterations: int
    prior_weight: float


class FitSetup(Document):
    """`targets.yaml`."""

    robot: str
    payload_kg: float
    trees: Trees
    targets: dict[str, Target]
    example_motion: dict[str, dict[str, float]]
    gear_ratio: list[float]
    start: dict[str, list[float]]
    start_shared: dict[str, float]
    ranges: dict[str, Range]
    fixed: dict[str, float]
    optimiser: Optimiser


@cache
def fit_setup() -> FitSetup:
    """The fit's targets, ranges and seeds."""
    return load(FitSetup, FOLDER / "targets.yaml")


def fit_trees(setup: FitSetup, robot: Robot) -> tuple[Array, Array, Index]:
    """Motions of the fit's trees: starts (M, n), ends (M, n) [rad] and tree of each, shape (M,)."""
    trees = setup.trees
    sequences = [
        configurations
        for configurations, _ in generate_configurations(
            robot,
            CollisionModel(robot),
            seed=trees.seed,
            budgets_rad=np.linspace(*trees.budget_rad, trees.count),
            points=trees.points,
            use_whole_budget=trees.use_whole_budget,
        )
    ]
    start = np.concatenate([sequence[:-1] for sequence in sequences])
    end = np.concatenate([sequence[1:] for sequence in sequences])
    return start, end, np.repeat(np.arange(trees.count), 2 * trees.points)


def set_drives(robot: Robot, setup: FitSetup, values: dict[str, float]) -> None:
    """Give the robot the drives of a parameter vector; base power closes idle at HOME on its target exactly."""
    split = 3  # one factor for the main axes 1-3, one for the wrist
    figures: dict[str, Array] = {"gear_ratio": np.asarray(setup.gear_ratio)}
    for name in JOINT_FIGURES:
        stem = name.split("_kg")[0].split("_nm")[0].split("_w_per")[0]
        factor = np.array([values[f"{stem}_main"]] * split + [values[f"{stem}_wrist"]] * (robot.joint_count - split))
        figures[name] = np.asarray(setup.start[name]) * factor
    shared = {name: values[name] for name in SHARED_FIGURES} | setup.fixed
    robot.drives = dataclasses.replace(robot.drives, **figures, **shared, base_power_w=0.0)  # type: ignore[arg-type]
    holding = MotionPaths(robot, robot.home_rad, robot.home_rad).idle_power_start_w[0]
    idle = setup.targets["idle_power_home_w"].aim[0]
    robot.drives = dataclasses.replace(robot.drives, base_power_w=float(idle - holding))


def figures_of(robot: Robot, motions: tuple[Array, Array, Index]) -> tuple[dict[str, float], Array]:
    """Figures of the targets for the robot's present drives, and the deviations of the motion nearest the example."""
    start, end, tree = motions
    paths = MotionPaths(robot, start, end)
    runs = paths.simulate(SPEED_LIMITS)
    idle = float(MotionPaths(robot, robot.home_rad, robot.home_rad).idle_power_start_w[0])
    figures = energy_model_figures(runs.duration_s, runs.energy_j, tree)
    figures["rising_slope_over_idle"] = figures["rising_chord_w"] / idle
    deviations = example_deviations(runs.duration_s, runs.energy_j)
    return figures | {"idle_power_home_w": idle}, deviations[np.abs(deviations).max(axis=1).argmin()]


def residuals(figures: dict[str, float], nearest: Array, setup: FitSetup) -> Array:
    """Misses of the targets, each over its scale; zero inside the aims.

    Args:
        figures: Figures of the targets.
        nearest: Relative deviations of the motion nearest to the example, shape (6,). [-]
        setup: Targets.
    """
    misses = []
    for name, target in setup.targets.items():
        values = nearest if name == "example_motion_deviation" else np.array([figures[name]])
        low = -target.aim[1] if name == "example_motion_deviation" else target.aim[0]
        misses.append((values - np.clip(values, low, target.aim[1])) / target.scale)
    return np.concatenate(misses)


def fit(setup: FitSetup, *, progress: bool = False) -> dict[str, float]:
    """Search the parameter values with the least squared misses, from several seeded starts.

    Returns:
        Value of every entry of `ranges`.
    """
    from scipy.optimize import least_squares

    robot = load_robot(setup.robot, Payload(setup.payload_kg))
    motions = fit_trees(setup, robot)
    names, settings = list(setup.ranges), setup.optimiser
    factors = np.array([name not in SHARED_FIGURES for name in names])
    low, high = np.array([setup.ranges[name] for name in names]).T

    def misses(shares: Array) -> Array:
        vector = low + shares * (high - low)
        set_drives(robot, setup, dict(zip(names, vector.tolist(), strict=True)))
        figures, nearest = figures_of(robot, motions)
        prior = np.sqrt(settings.prior_weight) * np.log(vector[factors])
        return np.concatenate([residuals(figures, nearest, setup), prior])

    rng = np.random.default_rng(settings.seed)
    first = (np.array([1.0 if name not in SHARED_FIGURES else setup.start_shared[name] for name in names]) - low) / (
        high - low
    )
    best, best_cost = low, np.inf
    for start in range(settings.starts):
        result = least_squares(
            misses,
            first if start == 0 else rng.uniform(0.2, 0.8, len(names)),
            bounds=(0.0, 1.0),
            diff_step=0.02,  # wide, as shares and extremes over the motions are not smooth
            max_nfev=settings.iterations,
        )
        if progress:
            print(f"fit: start {start + 1} of {settings.starts}, sum of squares {2 * result.cost:.4f}", flush=True)
        if result.cost < best_cost:
            best, best_cost = low + result.x * (high - low), result.cost
    return {name: round(float(value), 4) for name, value in zip(names, best, strict=True)}


def drives_document(robot: Robot) -> dict[str, object]:
    """The `drives` section of a robot file for the robot's present drives."""
    drives = robot.drives
    joints = {
        name: {
            "gear_ratio": float(drives.gear_ratio[j]),
            **{figure: float(f"{getattr(drives, figure)[j]:.6g}") for figure in JOINT_FIGURES},
        }
        for j, name in enumerate(robot.joint_names)
    }
    return {
        "provenance": "fitted on figures of a master's thesis (CTU Prague, 2023) by robojoule.reference.fit",
        "base_power_w": float(f"{drives.base_power_w:.6g}"),
        **{name: getattr(drives, name) for name in (*SHARED_FIGURES, *fit_setup().fixed)},
        "joints": joints,
    }


def main() -> None:
    """Fit, write the catalog entry's drives and the fit's residuals."""
    setup = fit_setup()
    values = fit(setup, progress=True)
    robot = load_robot(setup.robot, Payload(setup.payload_kg))
    set_drives(robot, setup, values)
    path = catalog_path(setup.robot)
    document = json.loads(path.read_text(encoding="utf-8"))
    document["drives"] = drives_document(robot)
    write_document(path, document)
    figures, _ = figures_of(load_robot(setup.robot, Payload(setup.payload_kg)), fit_trees(setup, robot))
    write_document(
        FOLDER / "fitted.yaml", {"parameters": values, "figures": {k: round(v, 4) for k, v in figures.items()}}
    )
    print(json.dumps(figures, indent=2))


if __name__ == "__main__":
    main()
