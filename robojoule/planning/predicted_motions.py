"""Predicted profiles of a program's motions; those that no predictor knows are simulated.

A predictor knows straight motions. Motions through coarse zones, and those along a path of the tool, are simulated at
the same speed limits, without an interval; motions with one speed limit have the sum of their profiles.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from robojoule.arrays import Array
from robojoule.inputs import counted
from robojoule.motion.blends import BlendedPaths
from robojoule.motion.groups import LoadedMotions
from robojoule.motion.motions import MovedMotions
from robojoule.motion.simulation import MotionPaths
from robojoule.motion.tool_motions import ToolMotions
from robojoule.planning.batch import TreeBatch
from robojoule.profile.predicted import PredictedProfiles, ProfilePredictor
from robojoule.profile.reference import reference_predictor

SPEED_LIMITS = 61  # of each profile
_POWERS = ("idle_start_w", "idle_end_w")


def predicted_profiles(batch: TreeBatch, predictor: ProfilePredictor | None = None) -> PredictedProfiles:
    """Profiles of the motions of a batch by a predictor, the one that everybody has if none is given."""
    limits = batch.speed_limits(SPEED_LIMITS)
    found = _predicted(batch.executed, limits[batch.leaders], predictor or reference_predictor(batch.robot))
    if not batch.is_tied:
        return found
    summed = {}
    for field in fields(PredictedProfiles):
        values = getattr(found, field.name)
        if field.name in _POWERS:
            summed[field.name] = values
            continue
        summed[field.name] = np.zeros_like(values)
        np.add.at(summed[field.name], batch.leaders, values)
    return PredictedProfiles(**(summed | {"speed_limit": limits}))


def simulated_instead(batch: TreeBatch) -> tuple[str, ...]:
    """What to say of motions that were simulated, as no predictor knows them."""
    blended = sum(len(vertex.moves) > 1 for graph in batch.graphs for vertex in graph.vertices)
    of_tool = sum(move.tool_path is not None for tree in batch.trees for move in tree.moves())
    return tuple(
        f"{counted(count, 'motion')} {where} {'was' if count == 1 else 'were'} simulated: "
        "predictors know straight motions only"
        for count, where in ((blended, "through coarse zones"), (of_tool, "along a path of the tool"))
        if count
    )


def _predicted(motions: MovedMotions, limits: Array, predictor: ProfilePredictor) -> PredictedProfiles:
    """Profiles of motions as they run, at speed limits (M, S)."""
    if isinstance(motions, MotionPaths):
        return predictor.predict(motions, limits)
    if isinstance(motions, LoadedMotions):
        found = _joined([(load.rows, _predicted(load.motions, limits[load.rows], predictor)) for load in motions.loads])
        alone = motions.before == np.arange(motions.motions)
        start_w = np.where(alone, found.idle_start_w, found.idle_end_w[motions.before])
        return _with_start(found, start_w)
    if isinstance(motions, ToolMotions):
        return _simulated(motions, limits)
    assert isinstance(motions, BlendedPaths)
    rows, lines = motions.straight
    simulated = np.setdiff1d(np.arange(motions.motions), rows)
    parts = [(simulated, _simulated(motions.subset(simulated), limits[simulated]))]
    if rows.size:
        parts.append((rows, predictor.predict(lines, limits[rows])))
    return _joined(parts)


def _simulated(motions: BlendedPaths | ToolMotions, limits: Array) -> PredictedProfiles:
    """Simulated profiles in the form of predicted ones."""
    runs = motions.simulate(limits)
    energies = runs.energy_j
    return PredictedProfiles(
        speed_limit=limits,
        duration_s=runs.duration_s,
        energy_j=energies,
        lower_j=energies,
        upper_j=energies,
        cautious_j=energies,
        idle_start_w=motions.idle_power_start_w,
        idle_end_w=motions.idle_power_end_w,
    )


def _joined(parts: list[tuple[np.ndarray[tuple[int], np.dtype[np.intp]], PredictedProfiles]]) -> PredictedProfiles:
    """Profiles of all motions, of those of some rows each."""
    count = sum(len(rows) for rows, _ in parts)
    joined = {}
    for field in fields(PredictedProfiles):
        pieces = [(rows, getattr(one, field.name)) for rows, one in parts]
        joined[field.name] = np.zeros((count, *pieces[0][1].shape[1:]))
        for rows, piece in pieces:
            joined[field.name][rows] = piece
    return PredictedProfiles(**joined)


def _with_start(profiles: PredictedProfiles, idle_start_w: Array) -> PredictedProfiles:
    values = {field.name: getattr(profiles, field.name) for field in fields(PredictedProfiles)}
    return PredictedProfiles(**(values | {"idle_start_w": idle_start_w}))
