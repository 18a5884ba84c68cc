"""Tables, claims and metrics from cycles whose figures are known."""

from dataclasses import replace

import numpy as np
import pytest

from reproduction.experiment.claims import plan_claims
from reproduction.experiment.outcomes import Outcome, verify
from reproduction.experiment.results import (
    COMPLEXITIES,
    ExperimentResults,
    metrics,
    payload_rows,
    plans_table,
    table_6_1,
    table_6_1_thesis,
    table_by_tree,
)
from reproduction.methods.method import MethodPlans, Variant
from robojoule.errors import PlanningError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun
from robojoule.planning.schedule import Schedule
from tests.core_cases import kr16
from tests.planning.trees import tree

VARIANTS = {
    Variant("unoptimized"): 1000.0,
    Variant("krc_polynomial", 4, "speed"): 800.0,
    Variant("krc_polynomial", 6, "speed"): 780.0,
    Variant("krc_polynomial", 4, "duration"): 760.0,
    Variant("krc_polynomial", 6, "duration"): 770.0,
    Variant("predicted_three_segment"): 750.0,
    Variant("optimum"): 700.0,
}
CYCLE_TIMES_PERCENT = (110.0, 121.0, 133.0, 150.0, 175.0, 200.0)


def cycle(energy_j, motions=3, cycle_s=2.2):
    """A plan and its run."""
    waits, durations = np.zeros(motions), np.full(motions, 0.7)
    plan = Schedule("optimal", cycle_s, durations, waits, waits, waits, waits, energy_j, energy_j - 0.01)
    run = CycleRun(
        names=tuple(f"move-{number}" for number in range(motions)),
        speed_limits=np.full(motions, 0.5),
        durations_s=durations,
        prior_waits_s=waits,
        post_waits_s=np.append(waits[1:], cycle_s - 0.7 * motions),
        vertex_energies_j=np.full(motions, energy_j / motions),
        peak_powers_w=np.full(motions, 2000.0),
        peak_torque_ratios=np.full(motions, 0.9),
        rms_torque_ratio=0.5,
        energy_j=energy_j,
        cycle_time_s=cycle_s,
        peak_power_w=2000.0,
    )
    return plan, run


def outcome(energies_j, **others):
    """Outcome of a method from its energies, R for each tree."""
    cycles = [[cycle(energy, **others) for energy in of_tree] for of_tree in energies_j]
    plans, runs = ([[pair[k] for pair in of_tree] for of_tree in cycles] for k in (0, 1))
    return Outcome(MethodPlans(plans), runs)


def results_of(variants, trees, cycle_times_percent, **others):
    """Tree t takes (1 + t / 10) times the energies of the variants; 10 % more at each further cycle time."""
    growth = (1 + np.arange(trees) / 10)[:, None] * (1 + np.arange(len(cycle_times_percent)) / 10)
    return ExperimentResults(
        tuple(f"experiment-{t + 1:02d}" for t in range(trees)),
        tuple(COMPLEXITIES[3 * t // trees] for t in range(trees)),
        np.full(trees, 2.0),
        np.full(trees, 950.0),
        cycle_times_percent,
        {variant: outcome((energy * growth).tolist(), **others) for variant, energy in variants.items()},
    )


@pytest.fixture(scope="module")
def results():
    return results_of(VARIANTS, 9, CYCLE_TIMES_PERCENT)


def test_savings_and_gaps_are_means_of_each_trees_share(results):
    rows = table_6_1(results)
    assert len(rows) == 6 * 5
    first = {(row["method"], row["krc_segments"]): row for row in rows[:5]}
    assert first["optimum", ""]["saving_percent"] == "30.0000"
    assert first["optimum", ""]["gap_to_optimum_percent"] == "0.0000"
    assert first["krc_polynomial", 4]["saving_percent"] == "24.0000"
    assert first["krc_polynomial", 4]["gap_to_optimum_percent"] == f"{100 * 60 / 700:.4f}"
    assert {row["trees"] for row in rows} == {9}


def test_the_published_convention_accumulates_waits_at_430_w(results):
    rows = {row["relaxation_percent"]: row for row in table_6_1(results) if row["method"] == "optimum"}
    energies = 700.0 * (1 + np.arange(9) / 10) * 1.1
    base = 950.0 + 0.31 * 2.0 * 430.0
    assert rows["121"]["saving_percent_published_convention"] == f"{100 * (1 - energies / base).mean():.4f}"


def test_the_better_spacing_of_profiling_runs_is_quoted(results):
    assert results.quoted_spacing == "duration"
    assert results.quoted()["krc_polynomial_4"] == Variant("krc_polynomial", 4, "duration")
    assert metrics(results)["krc_polynomial"] == metrics(results)["krc_polynomial_4"]
    assert metrics(results)["krc_polynomial_6"]["110"]["saving_percent"] == 23.0


def test_subsets_are_balanced_in_complexity(results):
    subsets = results.subsets()
    assert sorted(tree for trees in subsets.values() for tree in trees) == list(range(9))
    for trees in subsets.values():
        assert sorted(results.complexities[t] for t in trees) == ["complex", "medium", "simple"]


def test_subsets_of_the_thesis_have_its_chords_and_cycle_times(results):
    found = {(row["subset"], row["relaxation_percent"], row["krc_segments"]) for row in table_6_1_thesis(results)}
    assert {(s, k) for s, _, k in found if k} == {("1-10", 4), ("11-20", 6), ("21-30", 4)}
    assert {r for s, r, _ in found if s == "21-30"} == {"150", "175", "200"}


def test_one_row_per_tree(results):
    rows = table_by_tree(results, (110.0, 121.0, 133.0))
    assert len(rows) == 9
    assert rows[2]["krc_polynomial_4_121_j"] == f"{760 * 1.2 * 1.1:.3f}"
    assert rows[0]["ec_d_min_j"] == "950.000"
    assert not any("150" in name for name in rows[0])


def test_rows_of_the_payload_sensitivity(results):
    rows = payload_rows(results, 16.0)
    assert {row["method"] for row in rows} == {"unoptimized", "optimum"}
    assert rows[1] == {
        "payload_kg": "16",
        "relaxation_percent": "110",
        "method": "optimum",
        "mean_power_full_speed_w": "475.000",
        "saving_percent": "30.0000",
    }


def test_claims_are_judged_on_the_figures(results):
    batch = TreeBatch(kr16(), [tree()], 0.1)
    claims = {claim.claim: claim for claim in plan_claims(results, batch, 0.15)}
    held = {name: claim.held for name, claim in claims.items()}
    assert held["at 110 % the predicted profiles save more than the polynomial ones with 4 segments"] is True
    assert held["at 200 % the predicted profiles save less than the polynomial ones with 4 segments"] is False
    assert held["at 110 % six segments of the polynomial profile save more than four"] is False
    text = "two profiling runs instead of five nearly halve the time for obtaining profiles"
    assert claims[text].robojoule.startswith("2 against 5 runs")
    assert list(claims[text].row()) == ["claim", "thesis", "robojoule", "held"]


def test_results_without_the_thesis_settings_have_fewer_rows():
    few = {
        Variant("unoptimized"): 1000.0,
        Variant("krc_polynomial", 5, "speed"): 800.0,
        Variant("krc_polynomial", 5, "duration"): 760.0,
        Variant("predicted_three_segment"): 790.0,
        Variant("optimum"): 700.0,
    }
    results = results_of(few, 1, (140.0,))
    assert table_6_1_thesis(results) == []
    assert {row["saving_percent_published_convention"] for row in table_6_1(results)} == {""}
    assert "saving_percent_published_convention" not in metrics(results)["optimum"]["140"]
    assert len(plan_claims(results, TreeBatch(kr16(), [tree()], 0.1), 0.15)) == 4


def test_every_vertex_has_a_row(results):
    batch = TreeBatch(
        kr16(), [tree(points=((30.0, -90.0, 90.0, 0.0, 0.0, 0.0), (60.0, -80.0, 90.0, 0.0, 0.0, 0.0)))] * 9
    )
    table = plans_table(results_of(VARIANTS, 9, (121.0, 110.0), motions=4, cycle_s=3.0), batch)
    assert table.num_rows == 9 * 2 * 7 * 4
    assert table["vertex"].to_pylist()[:5] == [1, 2, 3, 4, 1]
    assert table["relaxation_percent"].to_pylist()[: 8 * 7 : 4] == [110.0] * 7 + [121.0] * 7
    assert table["krc_segments"].null_count == 9 * 2 * 3 * 4
    assert table["model_idle_prior_w"].null_count == table.num_rows
    first = table.slice(0, 1).to_pylist()[0]
    assert (first["tree_id"], first["method"], first["simulated_energy_j"]) == ("experiment-01", "unoptimized", 1100.0)


@pytest.mark.parametrize(
    ("energy_j", "message"),
    [(699.0, "less than the optimum, 700.000 J .greedy, tree 2, 110 %"), (700.0 - 1e-9, None)],
    ids=["better than the optimum", "equal"],
)
def test_results_that_cannot_be_are_refused(energy_j, message):
    outcomes = {
        Variant("optimum"): outcome([[700.0], [700.0]]),
        Variant("greedy"): outcome([[701.0], [energy_j]]),
    }
    if message is None:
        verify(outcomes, (110.0,))
        return
    with pytest.raises(PlanningError, match=message):
        verify(outcomes, (110.0,))


def test_late_cycles_are_refused():
    good = outcome([[700.0]])
    late = replace(good, runs=[[replace(good.runs[0][0], cycle_time_s=2.2 + 2e-6)]])
    with pytest.raises(PlanningError, match="differs from the planned one by 2e-06 s"):
        verify({Variant("optimum"): late}, (110.0,))


def test_a_bound_far_below_the_optimum_is_refused():
    good = outcome([[700.0]])
    loose = MethodPlans([[replace(good.planned.plans[0][0], bound_j=690.0)]])
    with pytest.raises(PlanningError, match=r"the proven bound 690\.000 J is too far below"):
        verify({Variant("optimum"): replace(good, planned=loose)}, (110.0,))
