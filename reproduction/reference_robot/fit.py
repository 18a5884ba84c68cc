"""Fit the drive parameters of the reference robot to published figures: `python -m reproduction.reference_robot.fit`.

Motor constants, friction, inverter efficiency, standby and peak torques of this robot are published nowhere. They are
fitted here, within ranges that other machines' published figures suggest (`targets.yaml`), so that simulated trees show
the published durations and power and profiles of the published shape. The search is seeded; its result goes into the
catalog.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from copy import copy

import numpy as np
from numpy.typing import ArrayLike

from reproduction.reference_robot.figures import TreeRuns, energy_model_figures, idle_power_home_w
from reproduction.reference_robot.setup import FOLDER, FitSetup, fit_setup
from reproduction.trees.generate import generate_configurations
from robojoule.arrays import Array, Index
from robojoule.calibration.parameters import ParameterGroup, ParameterVector
from robojoule.documents import write_document
from robojoule.motion.controller import PathTiming
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import catalog_path, load_robot
from robojoule.robots.collision import CollisionModel
from robojoule.robots.robot import Payload, Robot
from robojoule.robots.scaling import JointNumbers

SPEED_LIMITS = np.arange(1, 11) / 10.0
# Figures of the drives that the dimensionless numbers of the parameters' names make.
JOINT_NUMBERS = {
    "spin_up": "rotor_inertia_kg_m2",
    "coulomb_share": "coulomb_nm",
    "viscous_share": "viscous_nm_s_per_rad",
    "copper_share": "copper_w_per_nm2",
}
SHARED_FIGURES = ("filter_time_s", "inverter_efficiency", "drive_active_power_w")
PEAK_EFFORT = "peak_over_continuous_effort"
JOINTS = {"1": [0], "2": [1], "3": [2], "main": [0, 1, 2], "wrist": [3, 4, 5]}


class FitMotions:
    """Motions of the fit's trees: their rigid-body torques do not depend on what is fitted."""

    def __init__(self, setup: FitSetup, robot: Robot) -> None:
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
        self.tree: Index = np.repeat(np.arange(trees.count), 2 * trees.points)
        self.paths = MotionPaths(robot, start, end)

    def figures(self, robot: Robot) -> dict[str, float]:
        """Figures of a robot that differs in its drives and peak torques only."""
        paths = copy(self.paths)
        paths.robot, paths.timing = robot, PathTiming(robot, paths.torques, paths.path)
        runs = paths.simulate(SPEED_LIMITS)
        idle, change = paths.idle_power_end_w, np.abs(paths.delta_rad)
        tree_runs = TreeRuns(SPEED_LIMITS, runs.duration_s, runs.energy_j, idle, self.tree, change)
        return energy_model_figures(tree_runs, np.arange(len(self.tree)), idle_power_home_w(robot))


def fit_parameters(setup: FitSetup, robot: Robot) -> ParameterVector:
    """The fit's parameters of the drives as shares of their ranges, starting from the priors.

    Those of friction, copper and rotors are dimensionless (`robojoule.robots.scaling.JointNumbers`), one for a joint,
    for the main joints or for the wrist.
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
    groups = []
    for name, parameter in setup.parameters.items():
        if name == PEAK_EFFORT:
            continue
        stem, _, part = name.removesuffix("_s").rpartition("_")
        figure = JOINT_NUMBERS.get(stem, name)
        of = tuple(JOINTS[part]) if stem in JOINT_NUMBERS else None
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


def fitted_robot(robot: Robot, setup: FitSetup, values: Mapping[str, ArrayLike]) -> Robot:
    """The robot with the drives of parameter values; base power closes idle at HOME on its published value."""
    drives = fit_parameters(setup, robot).drives_of({k: v for k, v in values.items() if k != PEAK_EFFORT})
    variant = robot.variant(drives=drives, peak_effort_nm=robot.effort_nm * np.asarray(values[PEAK_EFFORT]))
    base = float(np.mean(setup.figures["idle_power_home_w"].bounds)) - idle_power_home_w(variant)
    return variant.variant(drives=dataclasses.replace(drives, base_power_w=base))


def misses(figures: Mapping[str, float], setup: FitSetup) -> dict[str, float]:
    """How far each fitted figure lies outside its bounds, over half their width: 0 where it is within. [-]"""
    found = {}
    for name, item in setup.figures.items():
        if item.weight > 0.0:
            low, high = item.bounds
            within = np.clip(figures[name], low * (1.0 + item.margin), high * (1.0 - item.margin))
            found[name] = item.weight * float(figures[name] - within) / ((high - low) / 2.0)
    return found


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
    motions, settings = FitMotions(setup, robot), setup.optimiser
    transforms = {name: parameter.transform for name, parameter in setup.parameters.items()}
    prior = np.array([float(transforms[name].inverse(np.array(p.prior))) for name, p in setup.parameters.items()])

    def values_at(shares: Array) -> dict[str, float]:
        pairs = zip(transforms.items(), shares, strict=True)
        return {name: float(f"{float(transform.value(np.array(share))):.4g}") for (name, transform), share in pairs}

    def cost(shares: Array) -> float:
        outside = misses(motions.figures(fitted_robot(robot, setup, values_at(shares))), setup)
        return sum(miss**2 for miss in outside.values()) + settings.prior_weight * float(((shares - prior) ** 2).sum())

    def report(text: str, least: float) -> None:
        if progress:
            print(f"fit: {text}, least cost {least:.4f}", flush=True)

    first = np.vstack([prior, qmc.Sobol(len(prior), seed=settings.seed).random(settings.trials)])
    costs = np.array([cost(point) for point in first])
    report(f"{len(first)} first points", costs.min())
    found = differential_evolution(
        cost,
        [(0.0, 1.0)] * len(prior),
        init=first[np.argsort(costs, kind="stable")[: settings.population]],
        maxiter=settings.generations,
        recombination=0.8,
        tol=0.0,
        polish=False,
        seed=settings.seed,
        callback=lambda intermediate_result: report(f"{intermediate_result.nfev} runs", intermediate_result.fun),
    )
    return values_at(found.x), [round(float(value), 4) for value in (costs[0], costs.min(), found.fun)]


def drives_document(robot: Robot, setup: FitSetup) -> dict[str, object]:
    """The `drives` section of a robot file for the robot's present drives."""
    drives = robot.drives
    joints = {
        name: {
            "gear_ratio": float(drives.gear_ratio[j]),
            **{figure: float(f"{getattr(drives, figure)[j]:.6g}") for figure in JOINT_NUMBERS.values()},
        }
        for j, name in enumerate(robot.joint_names)
    }
    shared = [name for name in (*SHARED_FIGURES, "least_cruise_share") if name not in setup.fixed]
    return {
        "provenance": "fitted on figures of a master's thesis (CTU Prague, 2023) by reproduction.reference_robot.fit",
        "base_power_w": float(f"{drives.base_power_w:.6g}"),
        **{name: getattr(drives, name) for name in (*shared, *setup.fixed)},
        "joints": joints,
    }


def main() -> None:
    """Fit, write the catalog entry's drives and the fit's residuals."""
    setup = fit_setup()
    values, costs = fitted_values(setup, progress=True)
    robot = fitted_robot(load_robot(setup.robot, Payload(setup.payload_kg)), setup, values)
    path = catalog_path(setup.robot)
    document = json.loads(path.read_text(encoding="utf-8"))
    document["drives"] = drives_document(robot, setup)
    joints = [joint for joint in document["joints"] if joint["type"] != "fixed"]
    for joint, peak in zip(joints, robot.peak_effort_nm, strict=True):
        joint["peak_effort_nm"] = float(f"{peak:.6g}")
    write_document(path, document)
    robot = load_robot(setup.robot, Payload(setup.payload_kg))
    figures = FitMotions(setup, robot).figures(robot)
    outside = misses(figures, setup)
    fitted = {
        "parameters": values,
        "figures": {name: round(value, 4) for name, value in figures.items()},
        "misses": {name: round(value, 4) for name, value in outside.items() if value},
        "cost": dict(zip(("prior", "best_first_point", "result"), costs, strict=True)),
    }
    write_document(FOLDER / "fitted.yaml", fitted)
    print(json.dumps(fitted, indent=2))


if __name__ == "__main__":
    main()
