"""The planning model and its solver against brute force, closed forms and a second solver."""

import itertools
from types import MappingProxyType

import numpy as np
import pytest
from scipy.optimize import brentq, linprog, minimize

from robojoule.errors import CycleTimeTooShort, InputError, PlanningError
from robojoule.planning.costs import VertexCosts, plan_energy_j
from robojoule.planning.graph import Arc, Collision, OptimizationGraph, Phase
from robojoule.planning.solver import PlanSolver
from robojoule.profile.piecewise import PiecewiseLinearProfile
from tests.planning.cases import analytic, costs_of, one_robot, ring

RELAXATIONS = (1.0, 1.1, 1.33, 2.0, 3.5)


def assert_feasible(graph, costs, plan):
    """Bounds, order and cycle time recomputed from the plan's arrays."""
    for v, vertex in enumerate(graph.vertices):
        assert costs[v].profile.d_min_s <= plan.durations_s[v] <= costs[v].profile.d_max_s
        assert plan.prior_waits_s[v] >= vertex.least_prior_wait_s
        assert plan.post_waits_s[v] >= vertex.least_post_wait_s
    for arc in graph.edges:
        u, v = graph.index[arc.tail], graph.index[arc.head]
        end = plan.starts_s[u] + plan.durations_s[u] + plan.post_waits_s[u] + plan.collision_waits_s[u]
        start = plan.starts_s[v] - plan.prior_waits_s[v] + arc.cycle_shift * plan.cycle_time_s
        assert end == pytest.approx(start, abs=1e-7)
    for arc in graph.links:
        u, v = graph.index[arc.tail], graph.index[arc.head]
        end = plan.starts_s[u] + plan.durations_s[u] + plan.post_waits_s[u]
        assert end <= plan.starts_s[v] + arc.cycle_shift * plan.cycle_time_s + 1e-7
    for pair in graph.collisions:
        a, b = (
            _occupied(graph, plan, name, phase)
            for name, phase in ((pair.first, pair.first_phase), (pair.second, pair.second_phase))
        )
        for shift in range(-4, 5):
            assert a[1] <= b[0] + shift * plan.cycle_time_s + 1e-7 or b[1] + shift * plan.cycle_time_s <= a[0] + 1e-7


def _occupied(graph, plan, name, phase):
    v = graph.index[name]
    start, end = plan.starts_s[v], plan.starts_s[v] + plan.durations_s[v]
    return {
        Phase.PRIOR: (start - plan.prior_waits_s[v], start),
        Phase.MOVE: (start, end),
        Phase.POST: (end, end + plan.post_waits_s[v] + plan.collision_waits_s[v]),
    }[phase]


@pytest.mark.parametrize("relaxation", RELAXATIONS)
def test_brute_force_on_three_motions(relaxation):
    profiles = [one.chords(4) for one in analytic(3, seed=3)]
    costs = costs_of(profiles, [430.0, 415.0, 440.0])
    graph = one_robot(3)
    cycle = relaxation * sum(p.d_min_s for p in profiles)
    plan = PlanSolver(graph, costs).solve(cycle)
    assert_feasible(graph, costs, plan)
    # There is a best plan in which all durations but one, or all of them and a wait, stand at breakpoints.
    best = np.inf
    for d in itertools.product(*(p.durations_s for p in profiles)):
        best = min(best, _cost(profiles, d, cycle, 415.0))
        for v, profile in enumerate(profiles):
            rest = cycle - sum(d) + d[v]
            if profile.d_min_s <= rest <= profile.d_max_s:
                best = min(best, _cost(profiles, (*d[:v], rest, *d[v + 1 :]), cycle, 415.0))
    assert plan.energy_j == pytest.approx(best, rel=1e-9)
    assert plan.bound_j == pytest.approx(best, rel=1e-9)
    assert plan.status == "optimal"


def _cost(profiles, d, cycle, idle_w):
    wait = cycle - sum(d)
    if wait < -1e-9:
        return np.inf
    return sum(float(p.value(x)) for p, x in zip(profiles, d, strict=True)) + idle_w * wait


@pytest.mark.parametrize("seed", range(3))
def test_linprog_finds_the_same_energy(seed):
    profiles = [one.chords(6) for one in analytic(10, seed)]
    idle = np.random.default_rng(seed).uniform(400.0, 450.0, 10)
    cycle = 1.4 * sum(p.d_min_s for p in profiles)
    plan = PlanSolver(one_robot(10), costs_of(profiles, idle.tolist())).solve(cycle)
    # Second formulation: amounts of each segment used, in any order, for the profiles are convex.
    slopes = np.concatenate([p.slopes_w for p in profiles])
    lengths = np.concatenate([np.diff(p.durations_s) for p in profiles])
    other = linprog(
        np.append(slopes, idle.min()),
        A_eq=np.ones((1, slopes.size + 1)),
        b_eq=[cycle - sum(p.d_min_s for p in profiles)],
        bounds=[*((0.0, length) for length in lengths), (0.0, None)],
    )
    base = sum(float(p.energies_j[0]) for p in profiles)
    assert plan.energy_j == pytest.approx(base + other.fun, rel=1e-9)


@pytest.mark.parametrize("relaxation", [1.1, 1.33, 2.0])
def test_many_chords_come_near_the_closed_form(relaxation):
    motions = analytic(6, seed=5)
    idle_w = 430.0
    cycle = relaxation * sum(one.low for one in motions)

    def durations(price_w):  # stationary point of a/d + c d + price d
        return np.array([np.clip(np.sqrt(one.a / max(one.c + price_w, 1e-9)), one.low, one.high) for one in motions])

    # Each c is below the idle power: before anybody waits, every motion goes as slow as it can.
    assert sum(one.high for one in motions) > cycle
    d = durations(brentq(lambda price: durations(price).sum() - cycle, -min(o.c for o in motions) + 1e-6, 1e6))
    best = sum(one.energy(x) for one, x in zip(motions, d, strict=True))
    plan = PlanSolver(one_robot(6), costs_of([one.chords(800) for one in motions], [idle_w] * 6)).solve(cycle)
    assert plan.energy_j == pytest.approx(best, rel=1e-5)
    assert plan.energy_j >= best - 1e-6
    assert plan.durations_s == pytest.approx(d, abs=0.02)


def test_slsqp_finds_the_same_plan():
    motions = analytic(4, seed=8)
    cycle = 1.25 * sum(one.low for one in motions)
    found = minimize(
        lambda x: sum(one.energy(d) for one, d in zip(motions, x, strict=False)) + 430.0 * x[-1],
        x0=[*(1.2 * one.low for one in motions), 0.05 * cycle],
        bounds=[*((one.low, one.high) for one in motions), (0.0, None)],
        constraints={"type": "eq", "fun": lambda x: x.sum() - cycle},
        options={"ftol": 1e-6, "maxiter": 500},
    )
    assert found.success, found.message
    plan = PlanSolver(one_robot(4), costs_of([one.chords(800) for one in motions], [430.0] * 4)).solve(cycle)
    assert plan.energy_j == pytest.approx(found.fun, rel=1e-5)


@pytest.mark.parametrize("seed", range(4))
def test_profiles_that_are_not_convex_are_solved_exactly(seed):
    rng = np.random.default_rng(seed)
    profiles = [PiecewiseLinearProfile(np.linspace(0.5, 1.5, 8), 300.0 + rng.uniform(0, 250, 8)) for _ in range(3)]
    idle_w, cycle = 300.0, 2.9
    costs = costs_of(profiles, [idle_w] * 3)
    plan = PlanSolver(one_robot(3), costs).solve(cycle)
    assert_feasible(one_robot(3), costs, plan)
    grid = np.linspace(0.5, 1.5, 141)  # holds every breakpoint
    e = [p.value(grid) for p in profiles]
    d = grid[:, None, None] + grid[None, :, None] + grid[None, None, :]
    total = e[0][:, None, None] + e[1][None, :, None] + e[2][None, None, :] + idle_w * (cycle - d)
    total[d > cycle + 1e-9] = np.inf
    assert plan.energy_j <= total.min() + 1e-6
    assert plan.energy_j == pytest.approx(total.min(), rel=5e-3)
    assert plan.energy_j == pytest.approx(plan.bound_j, rel=1e-8)
    hull = PlanSolver(one_robot(3), costs_of([p.lower_hull for p in profiles], [idle_w] * 3)).solve(cycle)
    assert hull.energy_j <= plan.energy_j + 1e-6


def test_the_hull_would_be_wrong_where_it_is_not_tight():
    bump = PiecewiseLinearProfile([1.0, 1.5, 2.0], [100.0, 190.0, 80.0])
    graph, costs = one_robot(1), [VertexCosts(bump, 1000.0, 1000.0)]
    plan = PlanSolver(graph, costs).solve(1.5)
    assert plan.energy_j == pytest.approx(190.0)
    assert PlanSolver(graph, [VertexCosts(bump.lower_hull, 1000.0, 1000.0)]).solve(1.5).energy_j == pytest.approx(90.0)


def test_required_waits_and_motions_of_zero_length():
    still = PiecewiseLinearProfile([0.0], [0.0])
    moving = analytic(1)[0].chords(5)
    graph = one_robot(3, waits={0: (0.5, 0.0), 1: (0.0, 1.25)})
    costs = costs_of([moving, still, moving], [430.0, 410.0, 450.0])
    least = 2 * moving.d_min_s + 1.75
    plan = PlanSolver(graph, costs).solve(least)
    assert_feasible(graph, costs, plan)
    assert plan.durations_s[1] == 0.0
    assert plan.energy_j == pytest.approx(2 * moving.energies_j[0] + 0.5 * 450.0 + 1.25 * 410.0)
    longer = PlanSolver(graph, costs).solve(least + 100.0)
    assert longer.post_waits_s[1] + longer.prior_waits_s[2] > 90.0  # where idle power is least


@pytest.mark.parametrize("wanted", [0.5, float("nan"), 0.0, -1.0])
def test_a_cycle_time_that_is_too_short_names_the_least_one(wanted):
    profiles = [one.chords(3) for one in analytic(3)]
    least = sum(p.d_min_s for p in profiles)
    with pytest.raises(CycleTimeTooShort, match=f"at least {least:.6f} s") as caught:
        PlanSolver(one_robot(3), costs_of(profiles, [430.0] * 3)).solve(wanted)
    assert caught.value.minimum_s == pytest.approx(least)


def test_the_least_cycle_time_as_printed_is_feasible():
    profiles = [one.chords(3) for one in analytic(3)]
    solver = PlanSolver(one_robot(3), costs_of(profiles, [430.0] * 3))
    least = sum(p.d_min_s for p in profiles)
    plan = solver.solve(float(f"{least:.6f}"))
    assert plan.durations_s == pytest.approx([p.d_min_s for p in profiles], abs=1e-6)


def test_one_model_serves_all_cycle_times_in_any_order():
    profiles = [one.chords(5) for one in analytic(5)]
    costs = costs_of(profiles, [430.0, 420.0, 440.0, 425.0, 435.0])
    least = sum(p.d_min_s for p in profiles)
    shared = PlanSolver(one_robot(5), costs)
    for relaxation in (1.5, 1.1, 2.0, 1.2):
        alone = PlanSolver(one_robot(5), costs).solve(relaxation * least)
        assert shared.solve(relaxation * least).energy_j == pytest.approx(alone.energy_j, rel=1e-9)


def test_of_equal_plans_the_preference_takes_the_one_that_waits():
    profile = PiecewiseLinearProfile([1.0, 2.0, 5.0], [100.0, 50.0, 50.0 + 3 * 400.0])
    costs = [VertexCosts(profile, 400.0, 400.0)]
    plan = PlanSolver(one_robot(1), costs, preference_w=1e-4).solve(4.0)
    assert plan.durations_s == pytest.approx([2.0])
    assert plan.energy_j == pytest.approx(50.0 + 2.0 * 400.0)
    assert plan.bound_j <= plan.energy_j
    assert plan.bound_j == pytest.approx(plan.energy_j, abs=1e-2)


def test_inputs_that_cannot_be_are_refused():
    costs = costs_of([one.chords(2) for one in analytic(2)], [430.0, 430.0])
    with pytest.raises(InputError, match="2 costs given for 3 vertices"):
        PlanSolver(one_robot(3), costs)
    with pytest.raises(InputError, match="v1: the idle power nan W"):
        PlanSolver(one_robot(2), [costs[0], VertexCosts(costs[1].profile, np.nan, 1.0)])


def test_plans_cannot_be_changed():
    plan = PlanSolver(one_robot(1), costs_of([analytic(1)[0].chords(2)], [430.0])).solve(5.0)
    with pytest.raises(ValueError, match="read-only"):
        plan.durations_s[0] = 0.0


class TestTwoRobots:
    """Robot a: a0, a1; robot b: b0, b1; durations on a grid, so that brute force can try every plan."""

    CYCLE = 8.0
    IDLE = MappingProxyType({"a": 40.0, "b": 60.0})

    def problem(self, links=(), collisions=(), waits=None):
        a, a_edges = ring(2, "a", "a", waits)
        b, b_edges = ring(2, "b", "b")
        graph = OptimizationGraph(a + b, a_edges + b_edges, tuple(links), tuple(collisions))
        d = np.arange(1.0, 4.5)
        profiles = [PiecewiseLinearProfile(d, k * 100.0 / d + 30.0 * d) for k in (1.0, 3.0, 2.0, 4.0)]
        costs = [VertexCosts(p, self.IDLE[v.robot], self.IDLE[v.robot]) for p, v in zip(profiles, a + b, strict=True)]
        return graph, costs

    def brute_force(self, graph, costs):
        """Least energy over all durations, waits and phases that are whole multiples of a second."""
        grid = np.arange(1, 5)
        best = np.inf
        for d in itertools.product(grid, repeat=4):
            waits = [range(int(self.CYCLE) + 1)] * 2
            for wait_a, wait_b, phase in itertools.product(*waits, range(int(self.CYCLE))):
                rest_a = self.CYCLE - d[0] - d[1] - wait_a
                rest_b = self.CYCLE - d[2] - d[3] - wait_b
                if rest_a < 0 or rest_b < 0:
                    continue
                energy = sum(float(c.profile.value(x)) for c, x in zip(costs, d, strict=True))
                energy += self.IDLE["a"] * (wait_a + rest_a) + self.IDLE["b"] * (wait_b + rest_b)
                if energy >= best:
                    continue
                starts = [0, d[0] + wait_a, phase, phase + d[2] + wait_b]
                if self._allowed(graph, d, starts, (wait_a, rest_a, wait_b, rest_b)):
                    best = energy
        return best

    def _allowed(self, graph, d, starts, waits):
        """Whether a plan with all waits after the motions keeps links and collisions, tried in several cycles."""
        cycle = self.CYCLE
        for arc in graph.links:
            u, v = graph.index[arc.tail], graph.index[arc.head]
            # The phase of robot b is free by whole cycles in the model as well: try all.
            if not any(starts[u] + d[u] <= starts[v] + k * cycle + arc.cycle_shift * cycle for k in (-2, -1, 0, 1, 2)):
                return False
        for pair in graph.collisions:
            spans = []
            for name, phase in ((pair.first, pair.first_phase), (pair.second, pair.second_phase)):
                v = graph.index[name]
                end = starts[v] + d[v]
                spans.append((starts[v], end) if phase is Phase.MOVE else (end, end + waits[v]))
            (a, b), (c, e) = spans
            if not any(b <= c + k * cycle and e + k * cycle <= a + cycle for k in range(-4, 5)):
                return False
        return True

    @pytest.mark.parametrize(
        "collisions",
        [
            [("a0", Phase.MOVE, "b0", Phase.MOVE)],
            [("a0", Phase.MOVE, "b0", Phase.MOVE), ("a1", Phase.MOVE, "b1", Phase.MOVE)],
            [("a0", Phase.MOVE, "b0", Phase.MOVE), ("a0", Phase.MOVE, "b1", Phase.MOVE)],
            [(f"a{i}", Phase.MOVE, f"b{j}", Phase.MOVE) for i in (0, 1) for j in (0, 1)],
            [("a0", Phase.POST, "b0", Phase.MOVE), ("a1", Phase.MOVE, "b1", Phase.MOVE)],
        ],
        ids=["one", "two", "a0 apart from b", "never both", "waiting and moving"],
    )
    def test_brute_force(self, collisions):
        graph, costs = self.problem(collisions=[Collision(*one) for one in collisions])
        plan = PlanSolver(graph, costs).solve(self.CYCLE)
        assert_feasible(graph, costs, plan)
        assert plan.energy_j == pytest.approx(plan_energy_j(costs, plan))
        assert plan.energy_j == pytest.approx(self.brute_force(graph, costs), rel=1e-6)
        assert plan.energy_j == pytest.approx(plan.bound_j, rel=1e-6)

    def test_never_both_moving_leaves_half_the_cycle_to_each(self):
        graph, costs = self.problem(
            collisions=[Collision(f"a{i}", Phase.MOVE, f"b{j}", Phase.MOVE) for i in (0, 1) for j in (0, 1)]
        )
        plan = PlanSolver(graph, costs).solve(self.CYCLE)
        assert plan.durations_s.sum() <= self.CYCLE + 1e-7
        free_graph, _ = self.problem()
        assert plan.energy_j > PlanSolver(free_graph, costs).solve(self.CYCLE).energy_j

    def test_a_process_delays_a_linked_robot_and_a_collision_wait_does_not(self):
        links = [Arc("a0", "b0"), Arc("b1", "a1", 0)]
        graph, costs = self.problem(links=links, waits={0: (0.0, 3.0)})
        plan = PlanSolver(graph, costs).solve(self.CYCLE)
        assert_feasible(graph, costs, plan)
        index = graph.index
        assert plan.starts_s[index["b0"]] >= plan.durations_s[0] + 3.0 - 1e-7
        assert plan.collision_waits_s.tolist() == [0.0] * 4

    def test_impossible_links_are_reported_with_the_case(self):
        links = [Arc("a0", "b0"), Arc("b0", "a1"), Arc("a1", "b1"), Arc("b1", "a0", 0)]
        graph, costs = self.problem(links=links)
        with pytest.raises(PlanningError, match="no plan for 4 vertices, 2 robots, cycle time 8 s"):
            PlanSolver(graph, costs).solve(self.CYCLE)
