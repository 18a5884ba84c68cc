"""Results of the plan experiment as tables: every plan, savings and gaps, one row a tree (thesis Tables 6.1-6.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pyarrow as pa

from reproduction.experiment.experiment import POINT_SPACINGS, PlannedCycle, Variant
from reproduction.experiment.gaps import PlanEnergies, gap_rows
from reproduction.tables import Row
from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch

IDLE_POWER_PUBLISHED_W = 430.0
# The thesis's unoptimized energies accumulate the waits of the columns before; factors of d_min x 430 W.
PUBLISHED_FACTORS = {110.0: 0.10, 121.0: 0.31, 133.0: 0.64, 150.0: 0.50, 175.0: 1.25, 200.0: 2.25}
# The thesis's three subsets of ten trees: which chords and which cycle times each was tried with.
THESIS_SUBSETS = {
    "1-10": (4, (110.0, 121.0, 133.0)),
    "11-20": (6, (110.0, 121.0, 133.0)),
    "21-30": (4, (150.0, 175.0, 200.0)),
}
COMPLEXITIES = ("simple", "medium", "complex")


@dataclass(frozen=True, eq=False)
class ExperimentResults:
    """Cycles of the experiment and what is needed to judge them.

    Attributes:
        tree_ids: Identifiers of the T trees.
        complexities: simple, medium or complex, one a tree.
        d_min_s: Least cycle time of each tree, shape (T,). [s]
        full_speed_energy_j: EC_dmin, energy of the fastest cycle, shape (T,). [J]
        cycles: All plans with their simulation.
    """

    tree_ids: tuple[str, ...]
    complexities: tuple[str, ...]
    d_min_s: Array
    full_speed_energy_j: Array
    cycles: tuple[PlannedCycle, ...]

    def variants(self) -> list[Variant]:
        """Variants in order of appearance."""
        return list(dict.fromkeys(cycle.variant for cycle in self.cycles))

    def relaxations(self) -> list[float]:
        """Relaxations in order of appearance. [%]"""
        return list(dict.fromkeys(cycle.relaxation_percent for cycle in self.cycles))

    def of(self, variant: Variant, relaxation_percent: float) -> list[PlannedCycle]:
        """Cycles of one variant and relaxation, one a tree in order."""
        return self._found.get((variant, relaxation_percent), [])

    @cached_property
    def _found(self) -> dict[tuple[Variant, float], list[PlannedCycle]]:
        found: dict[tuple[Variant, float], list[PlannedCycle]] = {}
        for cycle in sorted(self.cycles, key=lambda cycle: cycle.tree):
            found.setdefault((cycle.variant, cycle.relaxation_percent), []).append(cycle)
        return found

    def energies_j(self, variant: Variant, relaxation_percent: float) -> Array:
        """Simulated energies, shape (T,). [J]"""
        return np.array([cycle.run.energy_j for cycle in self.of(variant, relaxation_percent)])

    def savings_percent(self, variant: Variant, relaxation_percent: float) -> Array:
        """Saving against the unoptimized tree that waits at HOME (thesis Eq. 6.1), shape (T,). [%]"""
        base = self.energies_j(Variant("unoptimized"), relaxation_percent)
        return np.asarray(100.0 * (base - self.energies_j(variant, relaxation_percent)) / base)

    def published_savings_percent(self, variant: Variant, relaxation_percent: float) -> Array | None:
        """Saving against the thesis's published baseline, shape (T,); none where it published nothing. [%]"""
        factor = PUBLISHED_FACTORS.get(relaxation_percent)
        if factor is None:
            return None
        base = self.full_speed_energy_j + factor * self.d_min_s * IDLE_POWER_PUBLISHED_W
        return np.asarray(100.0 * (base - self.energies_j(variant, relaxation_percent)) / base)

    def gaps_percent(self, variant: Variant, relaxation_percent: float) -> Array:
        """Energy above the simulated optimum, shape (T,). [%]"""
        best = self.energies_j(Variant("optimum"), relaxation_percent)
        return np.asarray(100.0 * (self.energies_j(variant, relaxation_percent) - best) / best)

    def quoted_spacing(self) -> str:
        """The spacing of the profiling runs that saves more on average over all trees, relaxations and chords."""
        return self._quoted_spacing

    @cached_property
    def _quoted_spacing(self) -> str:
        return max(POINT_SPACINGS, key=self.spacing_saving_percent)

    def spacing_saving_percent(self, spacing: str) -> float:
        """Mean saving of `krc_polynomial` over all trees, relaxations and chords with one spacing. [%]"""
        variants = [variant for variant in self.variants() if variant.point_spacing == spacing]
        return float(np.mean([self.savings_percent(v, r) for v in variants for r in self.relaxations()]))

    def quoted(self) -> list[Variant]:
        """Variants that tables show: of `krc_polynomial` only the better spacing."""
        spacing = self.quoted_spacing()
        return [variant for variant in self.variants() if variant.point_spacing in (None, spacing)]

    def krc(self, segments: int) -> Variant:
        """The quoted variant of `krc_polynomial`."""
        return Variant("krc_polynomial", segments, self.quoted_spacing())

    def named(self) -> dict[str, Variant]:
        """Quoted variants by name, `krc_polynomial_6` with six chords."""
        return {
            variant.method + (f"_{variant.krc_segments}" if variant.krc_segments else ""): variant
            for variant in self.quoted()
        }

    def plan_energies(self) -> PlanEnergies:
        """Simulated energies of the quoted variants."""
        relaxations = tuple(self.relaxations())
        return PlanEnergies(
            relaxations,
            {
                name: np.stack([self.energies_j(variant, relaxation) for relaxation in relaxations], axis=1)
                for name, variant in self.named().items()
            },
        )

    def runs_per_motion(self, variant: Variant) -> float:
        """Runs of the controller's simulation that a method needs for a new motion, on average."""
        return self.of(variant, self.relaxations()[0])[0].runs_per_motion

    def subsets(self) -> dict[str, list[int]]:
        """The trees of the thesis's three subsets: each complexity is dealt out in turn, so that all are balanced."""
        names = list(THESIS_SUBSETS)
        result: dict[str, list[int]] = {name: [] for name in names}
        for turn, complexity in enumerate(COMPLEXITIES):
            members = [tree for tree, kind in enumerate(self.complexities) if kind == complexity]
            for place, tree in enumerate(members):
                result[names[(place + turn) % len(names)]].append(tree)
        return {name: sorted(trees) for name, trees in result.items()}


def plans_table(results: ExperimentResults, batch: TreeBatch) -> pa.Table:
    """Every plan, one row a vertex: `data/plans.parquet`."""
    columns: dict[str, list[object]] = {name: [] for name in PLANS_SCHEMA.names}
    place = {variant: number for number, variant in enumerate(results.variants())}
    for cycle in sorted(results.cycles, key=lambda c: (c.tree, c.relaxation_percent, place[c.variant])):
        plan, run = cycle.plan, cycle.run
        d_min = batch.d_min_s[batch.rows[cycle.tree]]
        for v, vertex in enumerate(batch.graphs[cycle.tree].vertices):
            costs = cycle.costs[v] if cycle.costs else None
            row: Row = {
                "tree_id": results.tree_ids[cycle.tree],
                "relaxation_percent": cycle.relaxation_percent,
                "method": cycle.variant.method,
                "krc_segments": cycle.variant.krc_segments,
                "point_spacing": cycle.variant.point_spacing,
                "vertex": v + 1,
                "move": vertex.name,
                "cycle_time_s": plan.cycle_time_s,
                "least_cycle_time_s": float(results.d_min_s[cycle.tree]),
                "d_min_s": float(d_min[v]),
                "planned_duration_s": float(plan.durations_s[v]),
                "duration_s": float(run.durations_s[v]),
                "speed_limit_percent": 100.0 * float(run.speed_limits[v]),
                "prior_wait_s": float(run.prior_waits_s[v]),
                "post_wait_s": float(run.post_waits_s[v]),
                "collision_wait_s": float(plan.collision_waits_s[v]),
                "model_idle_prior_w": costs.idle_prior_w if costs else None,
                "model_idle_post_w": costs.idle_post_w if costs else None,
                "model_energy_j": _known(plan.energy_j),
                "bound_j": _known(plan.bound_j),
                "simulated_energy_j": run.energy_j,
                "vertex_energy_j": float(run.vertex_energies_j[v]),
            }
            for name, value in row.items():
                columns[name].append(value)
    return pa.table(columns, schema=PLANS_SCHEMA)


PLANS_SCHEMA = pa.schema(
    [
        ("tree_id", pa.string()),
        ("relaxation_percent", pa.float64()),
        ("method", pa.string()),
        ("krc_segments", pa.int32()),
        ("point_spacing", pa.string()),
        ("vertex", pa.int32()),
        ("move", pa.string()),
        *(
            (name, pa.float64())
            for name in (
                "cycle_time_s",
                "least_cycle_time_s",
                "d_min_s",
                "planned_duration_s",
                "duration_s",
                "speed_limit_percent",
                "prior_wait_s",
                "post_wait_s",
                "collision_wait_s",
                "model_idle_prior_w",
                "model_idle_post_w",
                "model_energy_j",
                "bound_j",
                "simulated_energy_j",
                "vertex_energy_j",
            )
        ),
    ]
)


def _known(value: float) -> float | None:
    return None if np.isnan(value) else float(value)


def table_6_1(results: ExperimentResults) -> list[Row]:
    """Mean savings and gaps over all trees."""
    everything = list(range(len(results.tree_ids)))
    return [
        _mean_row(results, variant, relaxation, everything)
        for relaxation in results.relaxations()
        for variant in results.quoted()
    ]


def table_6_1_thesis(results: ExperimentResults) -> list[Row]:
    """Mean savings and gaps over the thesis's subsets, with the chords and cycle times it used there."""
    rows: list[Row] = []
    for subset, trees in results.subsets().items():
        segments, relaxations = THESIS_SUBSETS[subset]
        for relaxation in results.relaxations():
            if relaxation not in relaxations or not trees:
                continue
            rows += [
                {"subset": subset, **_mean_row(results, variant, relaxation, trees)}
                for variant in results.quoted()
                if variant.krc_segments in (None, segments)
            ]
    return rows


def _mean_row(results: ExperimentResults, variant: Variant, relaxation: float, trees: Sequence[int]) -> Row:
    published = results.published_savings_percent(variant, relaxation)
    return {
        "relaxation_percent": f"{relaxation:g}",
        "krc_segments": variant.krc_segments if variant.krc_segments is not None else "",
        "method": variant.method,
        "saving_percent": percent(results.savings_percent(variant, relaxation)[trees].mean()),
        "saving_percent_published_convention": percent(published[trees].mean()) if published is not None else "",
        "gap_to_optimum_percent": percent(results.gaps_percent(variant, relaxation)[trees].mean()),
        "trees": len(trees),
    }


def gaps_table(results: ExperimentResults) -> list[Row]:
    """Gaps to the optimum of every method, with the runs that it needs for a new motion."""
    runs = {name: f"{results.runs_per_motion(variant):.4g}" for name, variant in results.named().items()}
    return [row | {"runs_per_motion": runs[str(row["method"])]} for row in gap_rows(results.plan_energies(), {})]


def table_by_tree(results: ExperimentResults, relaxations: Sequence[float]) -> list[Row]:
    """Energies of all methods, one row a tree (thesis Tables 6.2 and 6.3)."""
    subset_of = {tree: subset for subset, trees in results.subsets().items() for tree in trees}
    rows: list[Row] = []
    for tree, tree_id in enumerate(results.tree_ids):
        row: Row = {
            "tree_id": tree_id,
            "complexity": results.complexities[tree],
            "subset": subset_of.get(tree, ""),
            "d_min_s": f"{results.d_min_s[tree]:.6f}",
            "ec_d_min_j": f"{results.full_speed_energy_j[tree]:.3f}",
        }
        for relaxation in results.relaxations():
            if relaxation in relaxations:
                for name, variant in results.named().items():
                    row[f"{name}_{relaxation:g}_j"] = f"{results.energies_j(variant, relaxation)[tree]:.3f}"
        rows.append(row)
    return rows


def metrics(results: ExperimentResults) -> dict[str, dict[str, dict[str, float] | float]]:
    """Method -> relaxation -> mean saving and gap, and method -> runs that it needs for a new motion.

    `krc_polynomial` stands for its best number of chords; each number has an entry of its own too.
    """
    named = results.named()
    polynomial = [variant for variant in results.quoted() if variant.method == "krc_polynomial"]
    if polynomial:
        means = [np.mean([results.savings_percent(v, r) for r in results.relaxations()]) for v in polynomial]
        named["krc_polynomial"] = polynomial[int(np.argmax(means))]
    return {
        name: {f"{relaxation:g}": _mean_metrics(results, variant, relaxation) for relaxation in results.relaxations()}
        | {"runs_per_motion": round(float(results.runs_per_motion(variant)), 2)}
        for name, variant in sorted(named.items())
    }


def _mean_metrics(results: ExperimentResults, variant: Variant, relaxation: float) -> dict[str, float]:
    published = results.published_savings_percent(variant, relaxation)
    values = {
        "saving_percent": results.savings_percent(variant, relaxation),
        "gap_to_optimum_percent": results.gaps_percent(variant, relaxation),
    }
    if published is not None:
        values["saving_percent_published_convention"] = published
    return {name: float(percent(value.mean())) for name, value in values.items()}


def payload_rows(results: ExperimentResults, payload_kg: float) -> list[Row]:
    """Mean power at full speed and savings with one payload; rows for the unoptimized trees and the optimum."""
    power = f"{float(np.mean(results.full_speed_energy_j / results.d_min_s)):.3f}"
    return [
        {
            "payload_kg": f"{payload_kg:g}",
            "relaxation_percent": f"{relaxation:g}",
            "method": method,
            "mean_power_full_speed_w": power,
            "saving_percent": percent(results.savings_percent(Variant(method), relaxation).mean()),
        }
        for relaxation in results.relaxations()
        for method in ("unoptimized", "optimum")
    ]


def percent(value: float) -> str:
    """A percentage as text, without a negative zero."""
    text = f"{value:.4f}"
    return "0.0000" if text == "-0.0000" else text
