"""Results of the plan experiment as tables: every plan, savings and gaps, one row per tree (thesis Tables 6.1-6.3)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import pyarrow as pa

from reproduction.experiment.gaps import PlanEnergies, gap_rows
from reproduction.experiment.outcomes import Outcome
from reproduction.methods.krc_polynomial import POINT_SPACINGS
from reproduction.methods.method import Variant
from reproduction.tables import Row
from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun

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
    """Outcomes of the experiment's methods and what is needed to judge them.

    Attributes:
        tree_ids: Identifiers of the T trees.
        complexities: simple, medium or complex, one per tree.
        least_cycle_times_s: Least cycle time of each tree, shape (T,). [s]
        full_speed_energy_j: EC_dmin, energy of the fastest cycle, shape (T,). [J]
        cycle_times_percent: R cycle times as shares of the least one. [%]
        outcomes: Plans of every variant with their simulation, in the order of the tables.
    """

    tree_ids: tuple[str, ...]
    complexities: tuple[str, ...]
    least_cycle_times_s: Array
    full_speed_energy_j: Array
    cycle_times_percent: tuple[float, ...]
    outcomes: dict[Variant, Outcome]

    def runs(self, variant: Variant, cycle_time_percent: float) -> list[CycleRun]:
        """Simulated cycles of a variant at one cycle time, one per tree in order."""
        place = self.cycle_times_percent.index(cycle_time_percent)
        return [of_tree[place] for of_tree in self.outcomes[variant].runs]

    def energies_j(self, variant: Variant, cycle_time_percent: float) -> Array:
        """Simulated energies, shape (T,). [J]"""
        return self.outcomes[variant].energy_j[:, self.cycle_times_percent.index(cycle_time_percent)]

    def savings_percent(self, variant: Variant, cycle_time_percent: float) -> Array:
        """Saving against the unoptimized tree that waits at HOME (thesis Eq. 6.1), shape (T,). [%]"""
        base = self.energies_j(Variant("unoptimized"), cycle_time_percent)
        return np.asarray(100.0 * (base - self.energies_j(variant, cycle_time_percent)) / base)

    def published_savings_percent(self, variant: Variant, cycle_time_percent: float) -> Array | None:
        """Saving against the thesis's published baseline, shape (T,); none where it published nothing. [%]"""
        factor = PUBLISHED_FACTORS.get(cycle_time_percent)
        if factor is None:
            return None
        base = self.full_speed_energy_j + factor * self.least_cycle_times_s * IDLE_POWER_PUBLISHED_W
        return np.asarray(100.0 * (base - self.energies_j(variant, cycle_time_percent)) / base)

    def gaps_percent(self, variant: Variant, cycle_time_percent: float) -> Array:
        """Energy above the simulated optimum, shape (T,). [%]"""
        best = self.energies_j(Variant("optimum"), cycle_time_percent)
        return np.asarray(100.0 * (self.energies_j(variant, cycle_time_percent) - best) / best)

    @cached_property
    def quoted_spacing(self) -> str:
        """The spacing of the profiling runs that saves more on average over all trees, cycle times and chords."""
        return max(POINT_SPACINGS, key=self.spacing_saving_percent)

    def spacing_saving_percent(self, spacing: str) -> float:
        """Mean saving of `krc_polynomial` over all trees, cycle times and chords with one spacing. [%]"""
        variants = [variant for variant in self.outcomes if variant.point_spacing == spacing]
        return float(np.mean([self.savings_percent(v, r) for v in variants for r in self.cycle_times_percent]))

    def quoted(self) -> dict[str, Variant]:
        """Variants that tables show, by name: of `krc_polynomial` only the better spacing."""
        shown = [v for v in self.outcomes if v.point_spacing is None or v.point_spacing == self.quoted_spacing]
        return {variant.name: variant for variant in shown}

    def krc(self, segments: int) -> Variant:
        """The quoted variant of `krc_polynomial`."""
        return Variant("krc_polynomial", segments, self.quoted_spacing)

    def plan_energies(self) -> PlanEnergies:
        """Simulated energies of the quoted variants."""
        energies = {name: self.outcomes[variant].energy_j for name, variant in self.quoted().items()}
        return PlanEnergies(self.cycle_times_percent, energies)

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
    """Every plan, one row per vertex: `data/plans.parquet`."""
    columns: dict[str, list[object]] = {name: [] for name in PLANS_SCHEMA.names}
    rising = sorted(range(len(results.cycle_times_percent)), key=results.cycle_times_percent.__getitem__)
    for tree, r, (variant, outcome) in product(range(len(batch.trees)), rising, results.outcomes.items()):
        for row in _plan_rows(results, batch, variant, outcome, tree, r):
            for name, value in row.items():
                columns[name].append(value)
    return pa.table(columns, schema=PLANS_SCHEMA)


def _plan_rows(
    results: ExperimentResults, batch: TreeBatch, variant: Variant, outcome: Outcome, tree: int, r: int
) -> Iterator[Row]:
    """Rows of one plan."""
    plan, run = outcome.planned.plans[tree][r], outcome.runs[tree][r]
    costs = outcome.planned.costs[tree] if outcome.planned.costs else None
    d_min = batch.d_min_s[batch.rows[tree]]
    for v, vertex in enumerate(batch.graphs[tree].vertices):
        yield {
            "tree_id": results.tree_ids[tree],
            "relaxation_percent": results.cycle_times_percent[r],
            "method": variant.method,
            "krc_segments": variant.krc_segments,
            "point_spacing": variant.point_spacing,
            "vertex": v + 1,
            "move": vertex.name,
            "cycle_time_s": plan.cycle_time_s,
            "least_cycle_time_s": float(results.least_cycle_times_s[tree]),
            "d_min_s": float(d_min[v]),
            "planned_duration_s": float(plan.durations_s[v]),
            "duration_s": float(run.durations_s[v]),
            "speed_limit_percent": 100.0 * float(run.speed_limits[v]),
            "prior_wait_s": float(run.prior_waits_s[v]),
            "post_wait_s": float(run.post_waits_s[v]),
            "collision_wait_s": float(plan.collision_waits_s[v]),
            "model_idle_prior_w": costs[v].idle_prior_w if costs else None,
            "model_idle_post_w": costs[v].idle_post_w if costs else None,
            "model_energy_j": _known(plan.energy_j),
            "bound_j": _known(plan.bound_j),
            "simulated_energy_j": run.energy_j,
            "vertex_energy_j": float(run.vertex_energies_j[v]),
        }


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
        _mean_row(results, variant, percent, everything)
        for percent in results.cycle_times_percent
        for variant in results.quoted().values()
    ]


def table_6_1_thesis(results: ExperimentResults) -> list[Row]:
    """Mean savings and gaps over the thesis's subsets, with the chords and cycle times it used there."""
    rows: list[Row] = []
    for subset, trees in results.subsets().items():
        segments, cycle_times_percent = THESIS_SUBSETS[subset]
        for percent in results.cycle_times_percent:
            if percent not in cycle_times_percent or not trees:
                continue
            rows += [
                {"subset": subset, **_mean_row(results, variant, percent, trees)}
                for variant in results.quoted().values()
                if variant.krc_segments in (None, segments)
            ]
    return rows


def _mean_row(results: ExperimentResults, variant: Variant, percent: float, trees: Sequence[int]) -> Row:
    published = results.published_savings_percent(variant, percent)
    return {
        "relaxation_percent": f"{percent:g}",
        "krc_segments": variant.krc_segments if variant.krc_segments is not None else "",
        "method": variant.method,
        "saving_percent": percentage(results.savings_percent(variant, percent)[trees].mean()),
        "saving_percent_published_convention": percentage(published[trees].mean()) if published is not None else "",
        "gap_to_optimum_percent": percentage(results.gaps_percent(variant, percent)[trees].mean()),
        "trees": len(trees),
    }


def gaps_table(results: ExperimentResults) -> list[Row]:
    """Gaps to the optimum of every method, with the runs that it needs for a new motion."""
    runs = {name: f"{_runs_per_motion(results, variant):.4g}" for name, variant in results.quoted().items()}
    return [row | {"runs_per_motion": runs[str(row["method"])]} for row in gap_rows(results.plan_energies(), {})]


def table_by_tree(results: ExperimentResults, cycle_times_percent: Sequence[float]) -> list[Row]:
    """Energies of all methods, one row per tree (thesis Tables 6.2 and 6.3)."""
    subset_of = {tree: subset for subset, trees in results.subsets().items() for tree in trees}
    rows: list[Row] = []
    for tree, tree_id in enumerate(results.tree_ids):
        row: Row = {
            "tree_id": tree_id,
            "complexity": results.complexities[tree],
            "subset": subset_of.get(tree, ""),
            "d_min_s": f"{results.least_cycle_times_s[tree]:.6f}",
            "ec_d_min_j": f"{results.full_speed_energy_j[tree]:.3f}",
        }
        for percent in results.cycle_times_percent:
            if percent in cycle_times_percent:
                for name, variant in results.quoted().items():
                    row[f"{name}_{percent:g}_j"] = f"{results.energies_j(variant, percent)[tree]:.3f}"
        rows.append(row)
    return rows


def metrics(results: ExperimentResults) -> dict[str, dict[str, dict[str, float] | float]]:
    """Method -> cycle time -> mean saving and gap, and method -> runs that it needs for a new motion.

    `krc_polynomial` is that with its best number of chords; each number has an entry of its own too.
    """
    named = results.quoted()
    polynomial = [variant for variant in named.values() if variant.method == "krc_polynomial"]
    if polynomial:
        means = [np.mean([results.savings_percent(v, r) for r in results.cycle_times_percent]) for v in polynomial]
        named["krc_polynomial"] = polynomial[int(np.argmax(means))]
    return {
        name: {f"{percent:g}": _mean_metrics(results, variant, percent) for percent in results.cycle_times_percent}
        | {"runs_per_motion": round(_runs_per_motion(results, variant), 2)}
        for name, variant in sorted(named.items())
    }


def _runs_per_motion(results: ExperimentResults, variant: Variant) -> float:
    return float(results.outcomes[variant].planned.runs_per_motion)


def _mean_metrics(results: ExperimentResults, variant: Variant, percent: float) -> dict[str, float]:
    published = results.published_savings_percent(variant, percent)
    values = {
        "saving_percent": results.savings_percent(variant, percent),
        "gap_to_optimum_percent": results.gaps_percent(variant, percent),
    }
    if published is not None:
        values["saving_percent_published_convention"] = published
    return {name: float(percentage(value.mean())) for name, value in values.items()}


def payload_rows(results: ExperimentResults, payload_kg: float) -> list[Row]:
    """Mean power at full speed and savings with one payload; rows for the unoptimized trees and the optimum."""
    power = f"{float(np.mean(results.full_speed_energy_j / results.least_cycle_times_s)):.3f}"
    return [
        {
            "payload_kg": f"{payload_kg:g}",
            "relaxation_percent": f"{percent:g}",
            "method": method,
            "mean_power_full_speed_w": power,
            "saving_percent": percentage(results.savings_percent(Variant(method), percent).mean()),
        }
        for percent in results.cycle_times_percent
        for method in ("unoptimized", "optimum")
    ]


def percentage(value: float) -> str:
    """A percentage as text, without a negative zero."""
    text = f"{value:.4f}"
    return "0.0000" if text == "-0.0000" else text
