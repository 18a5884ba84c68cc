"""Tables, claims and metrics from cycles whose figures are known."""

from dataclasses import replace

import numpy as np
import pytest

from reproduction.experiment.claims import plan_claims
from reproduction.experiment.experiment import PlannedCycle, Variant, verify
from reproduction.experiment.results import (
    ExperimentResults,
    metrics,
    payload_rows,
    plans_table,
    table_6_1,
    table_6_1_thesis,
    table_by_tree,
)
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
RELAXATIONS = (110.0, 121.0, 133.0, 150.0, 175.0, 200.0)


def cycle(number, relaxation, variant, energy_j, cycle_s=2.2):
    waits = np.zeros(3)
    plan = Schedule("optimal", cycle_s, np.full(3, 0.7), waits, waits, waits, waits, energy_j, energy_j - 0.01)
    run = CycleRun(
        names=("a", "b", "c"),
        speed_limits=np.full(3, 0.5),
        durations_s=np.full(3, 0.7),
        prior_waits_s=waits,
        post_waits_s=np.array([0.0, 0.0, 0.1]),
        vertex_energies_j=np.full(3, energy_j / 3),
        peak_powers_w=np.full(3, 2000.0),
        peak_torque_ratios=np.full(3, 0.9),
        energy_j=energy_j,
        cycle_time_s=cycle_s,
        peak_power_w=2000.0,
    )
    return PlannedCycle(number, relaxation, variant, plan, run, None)


@pytest.fixture(scope="module")
def results():
    """Nine trees; tree t takes (1 + t / 10) times the energies above; 10 % more at each further relaxation."""
    cycles = [
        cycle(t, relaxation, variant, energy * (1 + t / 10) * (1 + place / 10))
        for t in range(9)
        for place, relaxation in enumerate(RELAXATIONS)
        for variant, energy in VARIANTS.items()
    ]
    kinds = ("simple",) * 3 + ("medium",) * 3 + ("complex",) * 3
    ids = tuple(f"experiment-{t + 1:02d}" for t in range(9))
    return ExperimentResults(ids, kinds, np.full(9, 2.0), np.full(9, 950.0), tuple(cycles))


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
    assert results.quoted_spacing() == "duration"
    assert Variant("krc_polynomial", 4, "speed") not in results.quoted()
    assert metrics(results)["krc_polynomial"] == metrics(results)["krc_polynomial_4"]
    assert metrics(results)["krc_polynomial_6"]["110"]["saving_percent"] == 23.0


def test_subsets_are_balanced_in_complexity(results):
    subsets = results.subsets()
    assert sorted(tree for trees in subsets.values() for tree in trees) == list(range(9))
    for trees in subsets.values():
        assert sorted(results.complexities[t] for t in trees) == ["complex", "medium", "simple"]


def test_subsets_of_the_thesis_have_its_chords_and_relaxations(results):
    found = {(row["subset"], row["relaxation_percent"], row["krc_segments"]) for row in table_6_1_thesis(results)}
    assert {(s, k) for s, _, k in found if k} == {("1-10", 4), ("11-20", 6), ("21-30", 4)}
    assert {r for s, r, _ in found if s == "21-30"} == {"150", "175", "200"}


def test_one_row_a_tree(results):
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
    batch = TreeBatch(kr16(), [tree()])
    claims = {claim.claim: claim for claim in plan_claims(results, batch)}
    held = {name: claim.held for name, claim in claims.items()}
    assert held["at 110 % the predicted profiles save more than the polynomial ones with 4 segments"] is True
    assert held["at 200 % the predicted profiles save less than the polynomial ones with 4 segments"] is False
    assert held["at 110 % six segments of the polynomial profile save more than four"] is False
    text = "two profiling runs instead of five nearly halve the time for obtaining profiles"
    assert claims[text].ours.startswith("2 against 5 runs")
    assert list(claims[text].row()) == ["claim", "thesis", "ours", "held"]


def test_results_without_the_thesis_settings_have_fewer_rows():
    few = {
        Variant("unoptimized"): 1000.0,
        Variant("krc_polynomial", 5, "speed"): 800.0,
        Variant("krc_polynomial", 5, "duration"): 760.0,
        Variant("predicted_three_segment"): 790.0,
        Variant("optimum"): 700.0,
    }
    cycles = tuple(cycle(0, 140.0, variant, energy) for variant, energy in few.items())
    results = ExperimentResults(("experiment-01",), ("simple",), np.array([2.0]), np.array([950.0]), cycles)
    assert table_6_1_thesis(results) == []
    assert {row["saving_percent_published_convention"] for row in table_6_1(results)} == {""}
    assert "saving_percent_published_convention" not in metrics(results)["optimum"]["140"]
    assert len(plan_claims(results, TreeBatch(kr16(), [tree()]))) == 4


def test_every_vertex_has_a_row(results):
    batch = TreeBatch(
        kr16(), [tree(points=((30.0, -90.0, 90.0, 0.0, 0.0, 0.0), (60.0, -80.0, 90.0, 0.0, 0.0, 0.0)))] * 9
    )
    short = ExperimentResults(
        results.tree_ids,
        results.complexities,
        results.d_min_s,
        results.full_speed_energy_j,
        tuple(_lengthened(one, 4) for one in results.cycles[:14]),
    )
    table = plans_table(short, batch)
    assert table.num_rows == 14 * 4
    assert table["vertex"].to_pylist()[:4] == [1, 2, 3, 4]
    assert table["krc_segments"].null_count == 4 * 6
    assert table["model_idle_prior_w"].null_count == table.num_rows


def _lengthened(one, count):
    def longer(values):
        return np.resize(values, count)

    plan = Schedule(
        "optimal",
        2.2,
        *(
            longer(x)
            for x in (
                one.plan.durations_s,
                one.plan.prior_waits_s,
                one.plan.post_waits_s,
                one.plan.collision_waits_s,
                one.plan.starts_s,
            )
        ),
    )
    of_motions = ("speed_limits", "durations_s", "prior_waits_s", "post_waits_s", "vertex_energies_j")
    run = replace(one.run, **{name: longer(getattr(one.run, name)) for name in of_motions})
    return PlannedCycle(one.tree, one.relaxation_percent, one.variant, plan, run, None)


@pytest.mark.parametrize(
    ("others", "message"),
    [
        ([cycle(0, 110.0, Variant("greedy"), 699.0)], "less than the optimum, 700.000 J .greedy, tree 1, 110 %"),
        ([cycle(0, 110.0, Variant("greedy"), 700.0 - 1e-9)], None),
    ],
    ids=["better than the optimum", "equal"],
)
def test_results_that_cannot_be_are_refused(others, message):
    cycles = [cycle(0, 110.0, Variant("optimum"), 700.0), *others]
    if message is None:
        verify(cycles)
        return
    with pytest.raises(PlanningError, match=message):
        verify(cycles)


def test_late_cycles_are_refused():
    good = cycle(0, 110.0, Variant("optimum"), 700.0)
    late = replace(good.run, cycle_time_s=2.2 + 2e-6)
    with pytest.raises(PlanningError, match="differs from the planned one by 2e-06 s"):
        verify([PlannedCycle(0, 110.0, good.variant, good.plan, late, None)])
