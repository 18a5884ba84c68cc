"""The search for large cells, on cells that the exact one solves: feasible, near the optimum, repeatable."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from time import monotonic

import numpy as np
import pytest

from robojoule.planning.cells import annealing_costs, annealing_kernel
from robojoule.planning.cells.annealing import run
from robojoule.planning.cells.annealing_costs import MOST_LEVELS
from robojoule.planning.cells.check import check_plan
from robojoule.planning.cells.constructive import LATE_S, Annealer, plan_alone, timed
from robojoule.planning.cells.large import KEPT, LargeSearch
from robojoule.planning.cells.linear import Limits
from robojoule.planning.cells.model import CellModel, Parts
from robojoule.planning.cells.neighbourhoods import Neighbourhood, Neighbourhoods
from robojoule.planning.cells.numbering import Numbering
from robojoule.planning.cells.selection import is_whole, plan_of, poses_fit, selection_of
from robojoule.planning.cells.solve import solve_cell
from robojoule.planning.cells.tangents import spread_durations_s
from robojoule.planning.cells.timing import best_times
from robojoule.programs.cell import Handover
from tests.planning.cells.cases import free_of_charge, generated, two_robots

pytest.importorskip("numba")


@pytest.fixture(scope="module")
def cell():
    return generated(3, 0, (4, 7))


@pytest.fixture(scope="module")
def numbers(cell):
    return Numbering(cell)


@pytest.fixture(scope="module")
def best(cell):
    return solve_cell(cell, time_limit_s=120)


@pytest.fixture(scope="module")
def annealer(numbers):
    return Annealer(numbers, [plan_alone(numbers, r, Limits(gap=0.01), 10.0) for r in range(numbers.robots)])


def test_robots_alone_bound_the_cell(annealer, best):
    assert sum(single.found.bound_j for single in annealer.singles) <= best.energy_j


def test_annealing_gives_closed_tours_that_are_nearly_optimal(annealer, numbers, best):
    energies = []
    for seed in range(6):
        selection = annealer.run(20_000, seed)
        assert is_whole(numbers, selection)
        timing = timed(numbers, selection, Limits(gap=1e-4))
        if timing is not None and timing.late_s <= LATE_S:
            plan = plan_of(numbers, selection, timing.times, "feasible", 0.0, 0.0)
            assert check_plan(numbers.cell, plan).violations == ()
            energies.append(timing.energy_j)
    assert energies and min(energies) < 1.03 * best.energy_j


def test_equal_seeds_give_equal_choices(annealer):
    assert annealer.run(5000, 7).key == annealer.run(5000, 7).key
    states = [annealer._start(seed) for seed in range(5)]
    for seed, state in enumerate(states):
        run(annealer.problem, state, 50, seed)
    assert len({tuple(state.phase_s.tolist()) for state in states}) == 5


def test_the_cost_of_annealing_is_energy_less_the_price_of_the_cycle(annealer, numbers):
    """Without penalties: what the kernel sums must be the energy of the plan at its own durations."""
    free = replace(numbers.cell, lags=(), handovers=(), collisions=())
    alone = Annealer(Numbering(free), annealer.singles)
    state = alone._start(3)
    cost = run(alone.problem, state, 20_000, 3)
    p = alone.problem
    energy = sum(numbers.energies_j(state.leaving, state.move_s))
    for v in range(numbers.statics):
        stays = numbers.stays_of[int(state.pose[v])]
        fitting = stays[
            numbers.stay_least_s[stays] <= state.stay_s[v] + 1e-4
        ]  # closing the cycle scales them by some 1e-6
        energy += numbers.stay_power_w[fitting].min() * state.stay_s[v]
    exact = energy - p.price_w.sum() * p.cycle_time_s
    assert exact * (1.0 - 1e-5) <= cost <= exact * (1.0 + 1e-4)  # chords between tabled durations lie above the energy
    for r in range(numbers.robots):
        own = numbers.static_robot == r
        total = state.move_s[own].sum() + state.stay_s[own].sum()
        assert total == pytest.approx(p.cycle_time_s, rel=1e-5)


def test_movements_last_as_long_as_is_best_at_the_price_of_time_of_their_level(annealer, numbers):
    """Between two levels the tabled durations are joined by lines, a little above the best energy."""
    p = annealer.problem
    state = annealer._start(5)
    run(p, state, 20_000, 5)
    for r in range(numbers.robots):
        own = np.flatnonzero(numbers.static_robot == r)
        moves, times = state.leaving[own], state.move_s[own]
        inside = (times > numbers.d_min_s[moves] * 1.001) & (times < numbers.d_max_s[moves] * 0.999)
        slopes = numbers.marginal_powers_w(moves[inside], times[inside])
        levels = (slopes - p.price_w[r]) / annealer.step_w[r] - state.pace[own][inside]
        assert np.ptp(levels) < 0.3  # one level of the whole robot, beside those of its movements
        assert levels.max() < p.highest_level[r] + 0.3
        waits = state.stay_s[own] - numbers.least_stay_s[own]
        if levels.min() < p.highest_level[r] - 0.3:  # as long as slower movements are better, nobody waits
            assert waits.sum() == pytest.approx(0.0, abs=1e-3)
    assert np.abs(state.pace).max() <= MOST_LEVELS


def test_annealing_from_a_plan_begins_where_the_plan_is(annealer, numbers):
    """Without a single move the state has nearly the times of the plan."""
    for seed in range(6):
        selection = annealer.run(20_000, seed)
        timing = timed(numbers, selection, Limits(gap=1e-4))
        if timing is not None and timing.late_s <= LATE_S:
            break
    else:
        pytest.fail("no seed gave a plan")
    state = annealer.state_of(selection, timing)
    run(annealer.problem, state, 0, 0, 30.0)
    for r in range(numbers.robots):
        own = numbers.static_robot == r
        where = numbers.tail[numbers.movement_dynamic[selection.movements[r]]]
        assert state.move_s[where] == pytest.approx(timing.times.moves_s[r], rel=0.05, abs=0.05)
        assert state.move_s[own].sum() + state.stay_s[own].sum() == pytest.approx(numbers.cycle_time_s, rel=1e-5)


def test_a_run_of_annealing_is_stopped_with_a_closed_tour(annealer, numbers):
    begun = monotonic()
    selection = annealer.run(10**11, 1, stop=lambda: monotonic() > begun + 0.5)
    assert monotonic() - begun < 60
    assert is_whole(numbers, selection)


def test_what_is_compiled_is_made_anew_when_the_costs_change():
    costs = Path(annealing_costs.__file__).read_bytes()
    assert sha256(costs).hexdigest()[:12] == annealing_kernel.COSTS, "write the new digest into the kernel"


def test_the_best_plans_are_kept_one_for_each_seed(numbers, annealer):
    search = LargeSearch(numbers, Limits())
    plans = []
    for seed in range(12):
        selection = annealer.run(5_000, seed)
        timing = timed(numbers, selection, Limits(gap=1e-4))
        if timing is not None and timing.late_s <= LATE_S:
            plans.append((selection, timing))
            search._keep(selection, timing)
    assert len(plans) > 1
    energies = [timing.energy_j for _, timing in search.kept]
    assert energies == sorted(energies) and len(energies) <= KEPT
    assert energies[0] == min(timing.energy_j for _, timing in plans)
    assert len({selection.key for selection, _ in search.kept}) == len(energies)
    worst = search.kept[-1]
    search._keep(*plans[0], len(search.kept) - 1)
    assert all(timing is not worst[1] for _, timing in search.kept) or worst[0].key == plans[0][0].key


def test_neighbourhoods_lead_to_the_optimum_of_a_small_cell(annealer, numbers, best):
    selections = [annealer.run(20_000, seed) for seed in range(6)]
    timings = [timed(numbers, one, Limits(gap=1e-4)) for one in selections]
    start = max(
        ((s, t) for s, t in zip(selections, timings, strict=True) if t is not None and t.late_s <= LATE_S),
        key=lambda pair: pair[1].energy_j,
    )
    near = Neighbourhoods(numbers)
    everyone = frozenset(range(numbers.robots))
    found = near.search(Neighbourhood(everyone, everyone), *start, Limits(until=monotonic() + 60)) or start
    assert found[1].energy_j == pytest.approx(best.energy_j, rel=3e-3)
    held = Neighbourhood(frozenset(), frozenset())
    assert near.search(held, *found, Limits(until=monotonic() + 60)) is None


def test_a_plan_is_a_solution_of_the_model(annealer, numbers):
    """Values to start a search from satisfy every row: held at them, the model has the plan's energy."""
    selection = annealer.run(20_000, 1)
    timing = best_times(numbers, Parts.of(numbers), selection, Limits(gap=1e-4))
    if timing is None:
        pytest.fail("the choices of this seed have no times")
    model = CellModel(numbers)
    for at in spread_durations_s(numbers, model.movements, 60):
        model.add_tangents(model.movements, at)
    values = model.values_of(selection, timing)
    whole = np.flatnonzero(model.program.integer)
    found = model.program.solve(Limits(), relaxed=True, fixed=(whole, values[whole]))
    assert found.objective == pytest.approx(timing.energy_j, rel=5e-4)


def test_the_whole_search_ends_near_the_optimum(numbers, best):
    told = []
    found = LargeSearch(numbers, Limits(until=monotonic() + 30, gap=0.02), told.append).run()
    assert found.energy_j <= 1.03 * best.energy_j
    assert found.bound_j <= best.energy_j
    assert [one.energy_j for one in told] == sorted((one.energy_j for one in told), reverse=True)


def test_seeds_run_beside_each_other():
    numbers = Numbering(two_robots())
    with ThreadPoolExecutor(2) as executor:
        found = LargeSearch(numbers, Limits(until=monotonic() + 20, gap=0.05), executor=executor, workers=2).run()
    assert found.status == "optimal"


def test_a_stop_is_heard_by_runs_beside_each_other(annealer, numbers):
    begun = monotonic()
    with ThreadPoolExecutor(2) as executor:
        limits = Limits(stop=lambda: monotonic() > begun + 0.5)
        search = LargeSearch(numbers, limits, executor=executor, workers=2)
        found = list(search._runs(annealer, 10**10, 1))
    assert monotonic() - begun < 60
    assert len(found) == 2 and all(is_whole(numbers, selection) for selection in found)


def test_a_stop_ends_it_at_once():
    begun = monotonic()
    LargeSearch(Numbering(two_robots()), Limits(until=monotonic() + 100, stop=lambda: True)).run()
    assert monotonic() - begun < 60


def test_a_run_of_annealing_is_cut_to_the_time_that_is_left(numbers):
    search = LargeSearch(numbers, Limits(until=monotonic() + 10.0))
    assert search._affordable(50_000) == 50_000  # before anything is known
    search.pace_s = 1e-3
    assert 5_000 < search._affordable(50_000) <= 10_000
    assert search._affordable(3_000) == 3_000
    search.limits = Limits()
    assert search._affordable(50_000) == 50_000


def test_annealing_takes_a_cell_in_which_nothing_costs_energy():
    """By hand: a plan of no energy, and prices and steps that are numbers."""
    numbers = Numbering(free_of_charge())
    annealer = Annealer(numbers, [plan_alone(numbers, r, Limits(gap=0.01), 10.0) for r in range(numbers.robots)])
    assert np.isfinite(annealer.problem.highest_level).all() and np.isfinite(annealer.problem.move_time_s).all()
    assert is_whole(numbers, annealer.run(1000, 0))


def test_choices_whose_poses_do_not_fit_are_no_plan():
    free = replace(two_robots(), handovers=())
    found = CellModel(Numbering(free)).program.solve(Limits())
    selection = selection_of(CellModel(Numbering(free)), found.values)
    assert poses_fit(Numbering(free), selection)
    assert timed(Numbering(free), selection, Limits(gap=1e-3)) is not None
    n = Numbering(free)
    chosen = {
        n.static_names[n.stay_static[s]]: n.location_names[n.stay_location[s]]
        for stays in selection.stays.values()
        for s in stays
    }
    for pair, fits in (((chosen["a1"], chosen["b1"]), True), (("p" if chosen["a1"] == "q" else "q", "p"), False)):
        bound = Numbering(replace(free, handovers=(Handover("a1", "b1", (pair,)),)))
        assert poses_fit(bound, selection) == fits
        assert (timed(bound, selection, Limits(gap=1e-3)) is not None) == fits
