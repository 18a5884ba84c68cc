"""Rules, beliefs, the optimum, and the way back into the tree, on simulated motions."""

import itertools

import numpy as np
import pytest

from reproduction.methods.methods import (
    greedy,
    polynomial_costs,
    profiling_speed_limits,
    sampled_profiles,
    three_segment_costs,
    uniform_speed_limits,
)
from reproduction.methods.three_segment_profile import ThreeSegmentShape
from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.formats.tree_files import parse_tree, tree_to_data
from robojoule.motion.simulation import MotionPaths
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import simulate_trees
from robojoule.planning.optimum import DenseProfiles, optimal_plans, profile_below, solve_optimum
from robojoule.planning.rule import rule_plan
from robojoule.planning.solver import PlanSolver
from robojoule.planning.writeback import write_plans
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.sampled import sampled_profile
from tests.core_cases import kr16
from tests.planning.trees import busy_tree, tree

RELAXATIONS = np.array([1.0, 1.15, 1.6])


@pytest.fixture(scope="module")
def batch():
    return TreeBatch(kr16(), [tree(), busy_tree()])


@pytest.fixture(scope="module")
def times(batch):
    return batch.least_cycles_s[:, None] * RELAXATIONS


@pytest.fixture(scope="module")
def optimum(batch, times):
    return optimal_plans(batch, times, speed_limits=91)


def write_and_simulate(batch, plans):
    written = write_plans(batch, plans)
    return written, simulate_trees(batch, written)


class TestBatch:
    def test_motions_stand_tree_after_tree(self, batch):
        assert [rows.stop - rows.start for rows in batch.rows] == [4, 7]
        assert batch.d_min_s[4] == pytest.approx(batch.d_min_s[0])
        assert (batch.d_max_s >= batch.d_min_s).all()
        stay = [i + 4 for i, v in enumerate(batch.graphs[1].vertices) if v.name.startswith("stay")]
        assert batch.d_max_s[stay].min() == 0.0
        assert batch.least_cycles_s[1] == pytest.approx(batch.d_min_s[batch.rows[1]].sum() + 0.2 + 0.4 + 0.1)

    def test_predecessors_close_the_cycle(self, batch):
        before = batch.predecessors(np.arange(11.0))
        assert before.tolist() == [3.0, 0.0, 1.0, 2.0, 10.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]
        assert batch.predecessors(batch.idle_post_w) == pytest.approx(batch.idle_prior_w)

    def test_saturating_speed_limits_give_the_fastest_run_and_lower_ones_do_not(self, batch):
        top = batch.saturating_speed_limits[:, None]
        assert batch.paths.durations(top)[:, 0] == pytest.approx(batch.d_min_s, rel=1e-9)
        slower = batch.paths.durations(np.maximum(0.9 * top, 0.1))[:, 0]
        moving = batch.paths.moving & (top[:, 0] > 0.12)
        assert (slower[moving] > batch.d_min_s[moving]).all()

    def test_coarse_zones_are_refused_by_name(self):
        data = tree_to_data(tree())
        data["operations"][1]["zone"] = {"radius_m": 0.1}
        with pytest.raises(InputError, match="move 'm1' of tree 'there and back' has a coarse zone"):
            TreeBatch(kr16(), [parse_tree(data, "coarse")])


class TestRules:
    def test_unoptimized_waits_at_home(self, batch):
        plan = rule_plan(batch.graphs[0], batch.d_min_s[batch.rows[0]], 10.0)
        assert plan.post_waits_s[:-1].tolist() == [0.0, 0.0, 0.0]
        assert plan.post_waits_s[-1] == pytest.approx(10.0 - batch.least_cycles_s[0])
        assert plan.prior_waits_s.sum() == 0.0

    def test_a_rule_refuses_a_cycle_time_below_the_least(self, batch):
        least = float(batch.least_cycles_s[0])
        with pytest.raises(CycleTimeTooShort, match=f"at least {least:.6f} s"):
            rule_plan(batch.graphs[0], batch.d_min_s[batch.rows[0]], 0.9 * least)

    def test_uniform_is_one_speed_limit_that_just_fits(self, batch):
        times = batch.least_cycles_s[:, None] * np.array([1.0, 1.2, 50.0])
        limits = uniform_speed_limits(batch, times)
        for t, rows in enumerate(batch.rows):
            waits = batch.least_cycles_s[t] - batch.d_min_s[rows].sum()
            for r in (0, 1):
                total = batch.paths.durations(np.full((11, 1), limits[t, r]))[rows].sum() + waits
                assert total == pytest.approx(times[t, r], rel=1e-7)
                assert total <= times[t, r] + 1e-12
        assert limits[:, 2].tolist() == [0.1, 0.1]

    def test_greedy_slows_the_steepest_first_and_the_last_partially(self, batch):
        graph = batch.graphs[0]
        runs = [
            sampled_profile([1.0, 1.2, 3.0], [100.0, 80.0, 150.0], [1.0, 0.5, 0.1]),  # 100 J/s
            sampled_profile([1.0, 1.5, 3.0], [300.0, 100.0, 150.0], [1.0, 0.5, 0.1]),  # 400 J/s
            sampled_profile([1.0, 2.0, 3.0], [100.0, 150.0, 190.0], [1.0, 0.5, 0.1]),  # best at full speed
            sampled_profile([1.0, 1.4, 3.0], [140.0, 100.0, 150.0], [1.0, 0.5, 0.1]),  # 100 J/s
        ]
        assert greedy(graph, runs, 4.3).durations_s == pytest.approx([1.0, 1.3, 1.0, 1.0])
        assert greedy(graph, runs, 4.6).durations_s == pytest.approx([1.1, 1.5, 1.0, 1.0])
        late = greedy(graph, runs, 9.0)
        assert late.durations_s == pytest.approx([1.2, 1.5, 1.0, 1.4])
        assert late.post_waits_s == pytest.approx([0.0, 0.0, 0.0, 9.0 - 5.1])


class TestBeliefs:
    def test_profiling_runs_are_distinct_and_equidistant(self, batch):
        moving = batch.paths.moving
        by_speed = profiling_speed_limits(batch, "speed")
        assert np.diff(by_speed, n=2, axis=1) == pytest.approx(0.0, abs=1e-12)
        durations = batch.paths.durations(by_speed)[moving]
        assert (np.diff(durations, axis=1) < -1e-6).all()
        by_duration = batch.paths.durations(profiling_speed_limits(batch, "duration"))
        assert np.diff(by_duration, n=2, axis=1) == pytest.approx(0.0, abs=1e-7)
        assert by_duration[:, 0] == pytest.approx(batch.d_min_s, abs=1e-9)
        assert by_duration[:, -1] == pytest.approx(batch.d_max_s, abs=1e-9)
        with pytest.raises(InputError, match="unknown spacing 'energy'; allowed: speed, duration"):
            profiling_speed_limits(batch, "energy")

    def test_polynomial_costs_cover_the_whole_range_even_without_length(self, batch):
        limits = profiling_speed_limits(batch, "speed")
        runs = batch.paths.simulate(limits)
        profiles = sampled_profiles(runs.duration_s, runs.energy_j, limits)
        costs = polynomial_costs(profiles, 4, np.full(11, 1.0), np.full(11, 2.0))
        for v, cost in enumerate(costs):
            assert cost.profile.segments == (4 if batch.paths.moving[v] else 0)
            assert cost.profile.d_min_s == pytest.approx(batch.d_min_s[v])
            assert cost.profile.d_max_s == pytest.approx(batch.d_max_s[v])
            assert (cost.idle_prior_w, cost.idle_post_w) == (1.0, 2.0)

    def test_idle_power_is_the_rising_slope_or_that_of_the_vertex_before(self):
        d_min, d_max = np.array([0.5, 0.0, 0.5]), np.array([2.5, 0.0, 2.5])
        costs = three_segment_costs(
            d_min, [1.0, 0.0, 1.0], d_max, [100.0, 0.0, 100.0], [720.0, 0.0, 576.0], ThreeSegmentShape()
        )
        assert [cost.idle_post_w for cost in costs] == pytest.approx([500.0, 500.0, 400.0])
        assert [cost.idle_prior_w for cost in costs] == pytest.approx([500.0, 500.0, 400.0])
        with pytest.raises(InputError, match="idle power"):
            three_segment_costs([0.0], [0.0], [0.0], [0.0], [0.0], ThreeSegmentShape())


class TestWriteBack:
    def test_the_written_tree_takes_exactly_the_cycle_time(self, batch, times, optimum):
        _, runs = write_and_simulate(batch, optimum)
        for row, cycles in zip(times, runs, strict=True):
            for time, run in zip(row, cycles, strict=True):
                assert run.cycle_time_s == pytest.approx(time, abs=1e-9)

    def test_feasibility_and_cost_recomputed_from_the_written_tree(self, batch, optimum):
        written, runs = write_and_simulate(batch, optimum)
        for t, rows in enumerate(batch.rows):
            for k, result in enumerate(written[t]):
                configurations = result.configurations_rad()
                paths = MotionPaths(batch.robot, configurations[:-1], configurations[1:])
                energy, moved = 0.0, 0
                place = "start"
                for operation in result.atomic():
                    if operation.type == "move":
                        one = paths.simulate([operation.speed_limit_percent / 100.0])
                        energy += one.energy_j[moved, 0]
                        energy += operation.wait_before_s * paths.idle_power_start_w[moved]
                        energy += operation.wait_after_s * paths.idle_power_end_w[moved]
                        moved, place = moved + 1, "end"
                    else:
                        standing = (
                            paths.idle_power_start_w[0] if place == "start" else paths.idle_power_end_w[moved - 1]
                        )
                        energy += operation.duration_s * (standing + getattr(operation, "power_w", 0.0))
                assert runs[t][k].energy_j == pytest.approx(energy, rel=1e-12)
                assert runs[t][k].energy_j == pytest.approx(optimum[t][k].energy_j, rel=1e-5)
                assert (runs[t][k].durations_s <= batch.d_max_s[rows] + 1e-9).all()

    def test_required_waits_and_process_steps_stay(self, batch, optimum):
        written, _ = write_and_simulate(batch, optimum)
        for result in written[1]:
            steps = {operation.name: operation for operation in result.atomic()}
            assert (steps["part"].duration_s, steps["weld"].duration_s) == (0.2, 0.4)
            assert steps["stay too"].wait_after_s >= 0.1 - 1e-12

    def test_planning_a_written_tree_again_gives_the_same_cycle(self, batch, optimum):
        written, runs = write_and_simulate(batch, optimum)
        again = TreeBatch(batch.robot, [written[0][0]])
        assert again.least_cycles_s[0] <= runs[0][0].cycle_time_s + 1e-9

    def test_a_tree_that_goes_elsewhere_is_refused(self, batch):
        with pytest.raises(InputError, match="does not visit the configurations of 'there and back'"):
            simulate_trees(batch, [[batch.trees[1]], [batch.trees[1]]])


class TestOptimum:
    def test_the_gap_is_proven_and_closed(self, batch, optimum):
        _, runs = write_and_simulate(batch, optimum)
        for t, row in enumerate(optimum):
            for k, plan in enumerate(row):
                assert plan.bound_j <= plan.energy_j * (1 + 1e-12)
                assert runs[t][k].energy_j <= plan.bound_j * (1 + 1e-4)
                assert runs[t][k].energy_j >= plan.bound_j * (1 - 1e-7)

    def test_no_grid_of_speed_limits_is_better(self, batch, times, optimum):
        rows = batch.rows[0]
        grid = np.linspace(0.1, 1.0, 26)
        runs = batch.paths.simulate(np.broadcast_to(grid, (11, grid.size)))
        d, e = runs.duration_s[rows], runs.energy_j[rows]
        idle = min(batch.idle_post_w[rows])
        for k in (1, 2):
            best = np.inf
            for choice in itertools.product(range(grid.size), repeat=2):
                two = d[0, choice[0]] + d[1, choice[1]]
                left = times[0, k] - two - d[2][:, None] - d[3][None, :]
                energy = e[0, choice[0]] + e[1, choice[1]] + e[2][:, None] + e[3][None, :] + idle * left
                best = min(best, float(np.where(left >= 0.0, energy, np.inf).min()))
            assert optimum[0][k].bound_j <= best
            assert optimum[0][k].energy_j <= best * (1 + 1e-6)

    def test_without_proof_the_plan_is_nearly_the_same(self, batch, times, optimum):
        plans, costs = solve_optimum(batch, times, speed_limits=91, prove=False)
        assert len(costs) == 2
        for row, proven in zip(plans, optimum, strict=True):
            for plan, best in zip(row, proven, strict=True):
                assert np.isnan(plan.bound_j)
                assert plan.energy_j == pytest.approx(best.energy_j, rel=1e-4)

    def test_refinement_adds_points_where_it_is_asked_to(self, batch):
        dense = DenseProfiles(batch, 30)
        before = dense.profiles[1]
        wanted = float(before.durations_s[7:9].mean())
        dense.refine(np.array([[wanted]]), np.array([1]))
        after = dense.profiles[1]
        assert len(after) > len(before)
        new = np.setdiff1d(after.durations_s, before.durations_s)
        assert ((new > before.durations_s[6]) & (new < before.durations_s[9])).all()
        assert dense.profiles[0] is not after

    @pytest.mark.parametrize(
        "function",
        [
            lambda d: 300.0 / d + 100.0 + 400.0 * d,
            lambda d: 500.0 - 200.0 * np.sqrt(np.maximum(d - 0.5, 0.0)) + 300.0 * d,
            lambda d: 300.0 / d + 40.0 * np.sin(3.0 * d) + 400.0 * d,
            lambda d: 200.0 * d,
        ],
        ids=["convex", "steep without end", "wavy", "straight"],
    )
    @pytest.mark.parametrize("count", [12, 60])
    def test_the_profile_below_is_below(self, function, count):
        d = 0.5 + 2.5 * np.linspace(0.0, 1.0, count) ** 2
        profile = PiecewiseLinearProfile(d, function(d))
        below = profile_below(profile)
        fine = np.linspace(0.5, 3.0, 5001)
        lower = below.value(fine)
        assert (lower <= function(fine) + 1e-9).all()
        assert lower.min() > function(fine).min() - 0.25 * np.ptp(function(fine))
        if profile.is_convex:
            assert below.is_convex

    def test_one_segment_is_its_own_bound(self):
        line = PiecewiseLinearProfile([1.0, 2.0], [5.0, 7.0])
        assert profile_below(line) is line


def test_five_calls_plan_a_tree():
    """Profiles -> graph -> solve -> write back -> verify."""
    batch = TreeBatch(kr16(), [tree()])
    costs = DenseProfiles(batch, 60).costs(0)
    plan = PlanSolver(batch.graphs[0], costs).solve(1.3 * float(batch.least_cycles_s[0]))
    _, runs = write_and_simulate(batch, [[plan]])
    assert runs[0][0].energy_j == pytest.approx(plan.energy_j, rel=1e-3)
