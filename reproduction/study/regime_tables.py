"""Tables of a regime: what predictions and plans of a batch are worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields

import numpy as np

from reproduction.experiment.gaps import PlanEnergies, gap_rows, win_rows
from reproduction.methods.method import Method, Variant
from reproduction.methods.on_source import OnSource
from reproduction.study.ablations import main_methods
from reproduction.study.cases import PlantBatch, speed_limits
from reproduction.study.config import StudyMotionsParams
from reproduction.study.methods import evaluate_plans, hull_profiles
from reproduction.study.summary import parameter_rows
from reproduction.tables import Row
from robojoule.profile.parameters import profile_parameters
from robojoule.profile.predicted import PredictedProfiles, ProfilePredictor
from robojoule.profile.source import ProfileSource


@dataclass
class RegimeTables:
    """Result tables of a regime.

    Attributes:
        errors: Errors of the three parameters.
        gaps: Gaps to the optimum.
        wins: Wins and losses of methods against each other.
        plans: Energies of all plans.
        coverage: How often intervals hold the truth.
        ablations: Gaps with one step exchanged at a time.
    """

    errors: list[Row] = field(default_factory=list)
    gaps: list[Row] = field(default_factory=list)
    wins: list[Row] = field(default_factory=list)
    plans: list[Row] = field(default_factory=list)
    coverage: list[Row] = field(default_factory=list)
    ablations: list[Row] = field(default_factory=list)

    def extend(self, other: RegimeTables) -> None:
        """Add the rows of another one."""
        for one in fields(self):
            getattr(self, one.name).extend(getattr(other, one.name))


def prediction_rows(
    tables: RegimeTables,
    batch: PlantBatch,
    predictors: dict[str, ProfilePredictor],
    motions: StudyMotionsParams,
    key: Row,
) -> None:
    """Errors of predictors, nominal physics and the oracle, at the observed speed limits and on a fine grid."""
    grids = {"measured": speed_limits(motions), "fine": batch.speed_limits(motions.fine_speed_limits)}
    for grid, at in grids.items():
        runs = batch.paths.simulate(at)
        truth = profile_parameters(runs.duration_s, runs.energy_j)
        energies = {
            "oracle": batch.oracle_paths.simulate(at).energy_j,
            "nominal_physics": batch.nominal_paths.simulate(at).energy_j,
        }
        for name, predictor in predictors.items():
            predicted = predictor.predict(batch.nominal_paths, at)
            energies[name] = predicted.energy_j
            moving = batch.paths.moving
            inside = (runs.energy_j >= predicted.lower_j) & (runs.energy_j <= predicted.upper_j)
            if grid == "measured":
                width = (predicted.upper_j - predicted.lower_j)[moving] / 2.0 / predicted.energy_j[moving]
                tables.coverage.append(
                    key
                    | {
                        "model": name,
                        "coverage_percent": round(100.0 * float(inside[moving].mean()), 2),
                        "half_width_percent": round(100.0 * float(np.median(width)), 3),
                        "idle_error_percent": round(100.0 * _idle_error(batch, predicted), 4),
                        "noise_percent": round(100.0 * predictor.calibration.noise, 3),
                        "state_spread": round(predictor.calibration.state_spread, 4),
                        "residual_gain": round(predictor.residual.gain, 4),
                    }
                )
        for name, energy in energies.items():
            found = profile_parameters(runs.duration_s, energy)
            tables.errors.extend(parameter_rows(found, truth, key | {"model": name, "grid": grid}))


def _idle_error(batch: PlantBatch, predicted: PredictedProfiles) -> float:
    """Median relative error of idle power at both ends of the motions. [-]"""
    truth = np.concatenate([batch.idle_prior_w, batch.idle_post_w])
    found = np.concatenate([predicted.idle_start_w, predicted.idle_end_w])
    return float(np.median(np.abs(found / truth - 1.0)))


def plan_rows(tables: RegimeTables, plans: PlanEnergies, key: Row) -> None:
    """Add gaps, wins and energies."""
    tables.gaps.extend(gap_rows(plans, key))
    tables.wins.extend(win_rows(plans, key))
    for method, energies in plans.energy_j.items():
        for tree, row in enumerate(energies.tolist()):
            for percent, energy in zip(plans.cycle_times_percent, row, strict=True):
                tables.plans.append(
                    key | {"tree": tree, "relaxation_percent": percent, "method": method, "energy_j": energy}
                )


def joined(parts: Sequence[PlanEnergies]) -> PlanEnergies:
    """Plans of several batches as one."""
    names = parts[0].energy_j
    return PlanEnergies(
        parts[0].cycle_times_percent, {name: np.concatenate([part.energy_j[name] for part in parts]) for name in names}
    )


def physics_methods(
    batch: PlantBatch, predictors: dict[str, ProfilePredictor], params: StudyMotionsParams, *, cautious: bool = False
) -> dict[str, Method]:
    """Planning on the profiles of predictors, of nominal physics and of the oracle, by name."""
    limits = batch.speed_limits(params.predicted_speed_limits)
    sources: dict[str, ProfileSource] = {
        "nominal_physics": hull_profiles(batch.nominal_paths, limits),
        "oracle": hull_profiles(batch.oracle_paths, limits),
    }
    for name, predictor in predictors.items():
        predicted = predictor.predict(batch.nominal_paths, limits)
        sources[name] = predicted
        if cautious:
            sources[f"{name}_cautious"] = predicted.cautious()
    return {name: OnSource(Variant(name), source) for name, source in sources.items()}


def judged(
    batch: PlantBatch,
    predictors: dict[str, ProfilePredictor],
    methods: dict[str, Method],
    motions: StudyMotionsParams,
    regime: str,
) -> tuple[RegimeTables, PlanEnergies]:
    """What predictions and plans of a batch are worth, and the energies of all plans."""
    tables = RegimeTables()
    key: Row = {"regime": regime, "robot": batch.robot.name, "payload_kg": batch.robot.payload.mass_kg}
    prediction_rows(tables, batch, predictors, motions, key)
    plans = evaluate_plans(batch, methods, motions.relaxations_percent, motions.dense_speed_limits)
    plan_rows(tables, main_methods(plans), key)
    return tables, plans


def together(parts: Sequence[tuple[RegimeTables, PlanEnergies]]) -> tuple[RegimeTables, PlanEnergies]:
    """Rows and plans of several batches."""
    tables = RegimeTables()
    for found, _ in parts:
        tables.extend(found)
    return tables, joined([plans for _, plans in parts])
