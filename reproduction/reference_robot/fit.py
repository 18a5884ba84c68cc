"""Fit the drive parameters of the reference robot to published figures: `python -m reproduction.reference_robot.fit`.

Motor constants, friction, inverter efficiency and standby of this robot are published nowhere. They are fitted here,
within ranges that other machines' published figures suggest (`targets.yaml`), so that simulated trees show the
published power level and profiles of the published shape. The search is seeded; its result goes into the catalog.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from reproduction.reference_robot.check import PUBLISHED_FIGURES
from reproduction.reference_robot.figures import energy_model_figures, example_deviations, inside, tree_powers_w
from reproduction.trees.generate import generate_configurations
from robojoule.arrays import Array, Index
from robojoule.calibration.parameters import ParameterGroup, ParameterVector, Transform, share_of_range
from robojoule.documents import Document, load, write_document
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import catalog_path, load_robot
from robojoule.robots.collision import CollisionModel
from robojoule.robots.robot import Payload, Robot
from robojoule.robots.scaling import JointNumbers

FOLDER = Path(__file__).parent
SPEED_LIMITS = np.arange(1, 11) / 10.0
# Figures of the drives that the dimensionless numbers of the parameters' names make.
JOINT_NUMBERS = {
    "spin_up": "rotor_inertia_kg_m2",
    "coulomb_share": "coulomb_nm",
    "viscous_share": "viscous_nm_s_per_rad",
    "copper_share": "copper_w_per_nm2",
}
SHARED_FIGURES = ("filter_time_s", "inverter_efficiency", "drive_active_power_w")
MAIN_JOINTS = 3
TAIL = 0.025  # quantile of the figures of sets of trees, at either side
Range = tuple[float, float]
BOUNDS: dict[str, Range] = {item.metric: (item.low, item.high) for item in PUBLISHED_FIGURES if item.fitted}


class Target(Document):
    """What a miss weighs, over sets of how many trees a figure is looked at, its relative distance to the bounds."""

    scale: Annotated[float, Field(gt=0)]
    margin: Annotated[float, Field(ge=0)] = 0.0
    set_of: Annotated[int, Field(gt=0)] | None = None


class Parameter(Document):
    """A fitted parameter: range and prior, and where they come from. Its scale is logarithmic unless it may be 0."""

    range: Range
    prior: float
    reason: str

    @property
    def transform(self) -> Transform:
        """Value from the share of the range."""
        return share_of_range(*self.range)


class Trees(Document):
    """The fit's own trees."""

    seed: int
    count: int
    points: int
    budget_rad: Range
    use_whole_budget: bool


class Optimiser(Document):
    """Differential evolution from the best of some trial points; sets of trees that are drawn; weight of the prior."""

    seed: int
    trials: int
    population: Annotated[int, Field(ge=5)]
    generations: int
    draws: int
    prior_weight: float


class FitSetup(Document):
    """`targets.yaml`."""

    robot: str
    payload_kg: float
    trees: Trees
    targets: dict[str, Target]
    parameters: dict[str, Parameter]
    gear_ratio: list[float]
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


def fit_parameters(setup: FitSetup, robot: Robot) -> ParameterVector:
    """The fit's parameters as shares of their ranges, starting from the priors.

    Those of friction, copper and rotors are dimensionless (`robojoule.robots.scaling.JointNumbers`), one for the main
    joints and one for the wrist.
    """
    effort, velocity = robot.effort_nm, robot.velocity_rad_s
    motor_speed, ones = np.asarray(setup.gear_ratio) * velocity, np.ones(robot.joint_count)
    units = JointNumbers(motor_speed, ones, ones, ones, motor_speed).drives(effort, velocity)
    nominal = dataclasses.replace(
        robot.drives,
        **setup.fixed,  # type: ignore[arg-type]
        gear_ratio=units["gear_ratio"],
        base_power_w=0.0,
    )
    joints = {"main": range(MAIN_JOINTS), "wrist": range(MAIN_JOINTS, robot.joint_count)}
    groups = []
    for name, parameter in setup.parameters.items():
        stem, _, part = name.removesuffix("_s").rpartition("_")
        figure = JOINT_NUMBERS.get(stem, name)
        of = tuple(joints[part]) if stem in JOINT_NUMBERS else None
        groups.append(
            ParameterGroup(
                name=name,
                figure=figure,
                transform=parameter.transform,
                unit=np.ones(()) if of is None else units[figure][list(of)],
                joints=of,
                start=np.atleast_1d(parameter.transform.inverse(np.array(parameter.prior))),
                scale=np.ones(1),
                lower=np.zeros(1),
                upper=np.ones(1),
            )
        )
    return ParameterVector(nominal, tuple(groups))


def with_drives(robot: Robot, setup: FitSetup, values: Mapping[str, ArrayLike]) -> Robot:
    """The robot with the drives of parameter values; base power closes idle at HOME on its published value."""
    drives = fit_parameters(setup, robot).drives_of(values)
    low, high = BOUNDS["idle_power_home_w"]
    base = (low + high) / 2.0 - idle_power_home_w(robot.variant(drives=drives))
    return robot.variant(drives=dataclasses.replace(drives, base_power_w=base))


def idle_power_home_w(robot: Robot) -> float:
    """Idle power at HOME. [W]"""
    return float(MotionPaths(robot, robot.home_rad, robot.home_rad).idle_power_start_w[0])


def misses(robot: Robot, motions: tuple[Array, Array, Index], setup: FitSetup) -> tuple[dict[str, float], Array]:
    """Figures of the robot's present drives, and how far they lie outside their bounds, each over its scale.

    Args:
        robot: Robot.
        motions: Motions of the fit's trees, see `fit_trees`.
        setup: Targets.

    Returns:
        Figures by name (over all trees), and the misses: zero where the rule of `targets.yaml` is kept. [-]
    """
    start, end, tree = motions
    runs = MotionPaths(robot, start, end).simulate(SPEED_LIMITS)
    duration, energy = runs.duration_s, runs.energy_j
    idle = idle_power_home_w(robot)
    figures = energy_model_figures(duration, energy, tree)
    figures |= {"rising_slope_over_idle": figures["rising_chord_w"] / idle, "idle_power_home_w": idle}
    powers = tree_powers_w(duration, energy, tree)
    trees = [tree == number for number in np.unique(tree)]
    found, deviations = inside(duration, energy), np.abs(example_deviations(duration, energy)).max(axis=1)
    by_tree: dict[str, tuple[Array, Callable[..., Array]]] = {  # figure of a set of trees from those of its trees
        "mean_power_full_speed_w": (powers, np.mean),
        "optimum_inside_percent": (np.array([100.0 * found[of].mean() for of in trees]), np.mean),
        "example_motion_deviation": (np.array([deviations[of].min() for of in trees]), np.min),
    }
    outside = []
    for name, target in setup.targets.items():
        low, high = BOUNDS[name][0] * (1.0 + target.margin), BOUNDS[name][1] * (1.0 - target.margin)
        values = np.array([figures[name]])
        if target.set_of is not None:
            of_tree, combine = by_tree[name]
            sets = np.random.default_rng(setup.optimiser.seed).integers(
                len(of_tree), size=(setup.optimiser.draws, target.set_of)
            )
            values = np.quantile(combine(of_tree[sets], axis=1), [TAIL, 1.0 - TAIL])
        outside.append((values - np.clip(values, low, high)) / target.scale)
    return figures, np.concatenate(outside)


def fitted_values(setup: FitSetup, *, progress: bool = False) -> tuple[dict[str, float], list[float]]:
    """Search the parameter values that miss the targets least, nearest to the priors where the targets leave room.

    Shares of motions and extremes over trees are not smooth, so the search is differential evolution. It starts
    from the best among the prior and points all over the ranges.

    Returns:
        Value of every parameter, and the cost (sum of squares): of the prior, of the best first point, of the result.
    """
    from scipy.optimize import differential_evolution
    from scipy.stats import qmc

    robot = load_robot(setup.robot, Payload(setup.payload_kg))
    motions = fit_trees(setup, robot)
    settings, vector = setup.optimiser, fit_parameters(setup, robot)
    prior = vector.start

    def values_at(shares: Array) -> dict[str, float]:
        return {name: float(f"{value.item():.4g}") for name, value in vector.values(shares).items()}

    def cost(shares: Array) -> float:
        outside = misses(with_drives(robot, setup, values_at(shares)), motions, setup)[1]
        return float((outside**2).sum() + settings.prior_weight * ((shares - prior) ** 2).sum())

    def report(text: str, least: float) -> None:
        if progress:
            print(f"fit: {text}, least cost {least:.4f}", flush=True)

    first = np.vstack([prior, qmc.Sobol(len(prior), seed=settings.seed).random(settings.trials)])
    costs = np.array([cost(point) for point in first])
    report(f"{len(first)} first points", costs.min())
    found = differential_evolution(
        cost,
        list(zip(vector.lower, vector.upper, strict=True)),
        init=first[np.argsort(costs, kind="stable")[: settings.population]],
        maxiter=settings.generations,
        recombination=0.8,
        tol=0.0,
        polish=False,
        seed=settings.seed,
        callback=lambda intermediate_result: report(f"{intermediate_result.nfev} runs", intermediate_result.fun),
    )
    return values_at(found.x), [round(float(value), 4) for value in (costs[0], costs.min(), found.fun)]


def drives_document(robot: Robot) -> dict[str, object]:
    """The `drives` section of a robot file for the robot's present drives."""
    drives = robot.drives
    joints = {
        name: {
            "gear_ratio": float(drives.gear_ratio[j]),
            **{figure: float(f"{getattr(drives, figure)[j]:.6g}") for figure in JOINT_NUMBERS.values()},
        }
        for j, name in enumerate(robot.joint_names)
    }
    return {
        "provenance": "fitted on figures of a master's thesis (CTU Prague, 2023) by reproduction.reference_robot.fit",
        "base_power_w": float(f"{drives.base_power_w:.6g}"),
        **{name: getattr(drives, name) for name in (*SHARED_FIGURES, *fit_setup().fixed)},
        "joints": joints,
    }


def main() -> None:
    """Fit, write the catalog entry's drives and the fit's residuals."""
    setup = fit_setup()
    values, costs = fitted_values(setup, progress=True)
    robot = with_drives(load_robot(setup.robot, Payload(setup.payload_kg)), setup, values)
    path = catalog_path(setup.robot)
    document = json.loads(path.read_text(encoding="utf-8"))
    document["drives"] = drives_document(robot)
    write_document(path, document)
    robot = load_robot(setup.robot, Payload(setup.payload_kg))
    figures, outside = misses(robot, fit_trees(setup, robot), setup)
    fitted = {
        "parameters": values,
        "figures": {name: round(value, 4) for name, value in figures.items()},
        "largest_miss": round(float(np.abs(outside).max()), 4),
        "cost": dict(zip(("prior", "best_first_point", "result"), costs, strict=True)),
    }
    write_document(FOLDER / "fitted.yaml", fitted)
    print(json.dumps(fitted, indent=2))


if __name__ == "__main__":
    main()
