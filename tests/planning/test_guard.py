"""Bounds of plans: overloads only if allowed, a peak power as a constraint, paths that touch something told."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import robojoule as rj
from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.overload import bearing, check_torques
from robojoule.planning.path_checks import collision_warnings
from robojoule.planning.power_limit import within_power
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.robots.collision import FLOOR, CollisionModel, path_points_rad

KR16 = rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)
HOME = [0, -90, 90, 0, 0, 0]
PICK = [HOME, [50, -70, 80, 0, 30, 0], [-20, -60, 100, 40, 0, 0], HOME]
STRETCHED = [[0, -20, 20, 0, 0, 0], [60, 0, 0, 0, 0, 0], [0, -20, 20, 0, 0, 0]]


def program(degrees, name="cycle"):
    return rj.Program(tree_from_configurations(name, np.radians(degrees)))


class TestOverload:
    heavy = rj.load_robot("kuka_kr500_r2800_2", payload_kg=500)

    def test_what_the_limits_do_not_bear_is_refused_unless_allowed(self):
        """Gravity alone takes 117 % of joint 2's limit: its balancer is left out."""
        for allowed in (0.0, 10.0):
            with pytest.raises(InputError, match="cannot move the arm in motion 1: gravity and friction take"):
                rj.optimize(program(STRETCHED), self.heavy, cycle_time="+10%", allow_overload_percent=allowed)
        plan = rj.optimize(program(STRETCHED), self.heavy, cycle_time="+10%", allow_overload_percent=40)
        assert 1.17 < plan.peak_torque_ratio <= 1.4
        assert any(f"reaches {100.0 * plan.peak_torque_ratio:.1f} % of its peak limit" in w for w in plan.warnings)
        assert plan.peak_torque_ratio == max(move.peak_torque_ratio for move in plan.moves)

    def test_it_changes_nothing_where_limits_are_kept(self):
        plain, strong = (
            rj.optimize(program(PICK), KR16, cycle_time="+10%", allow_overload_percent=p) for p in (0.0, 50.0)
        )
        assert strong.energy_j == pytest.approx(plain.energy_j, rel=1e-9)
        assert strong.peak_torque_ratio == pytest.approx(plain.peak_torque_ratio, rel=1e-9)
        assert strong.warnings == plain.warnings == ()

    def test_accelerations_stay_those_of_the_limits(self):
        strong = bearing(KR16, 60.0)
        np.testing.assert_allclose(strong.peak_effort_nm, 1.6 * KR16.peak_effort_nm)
        np.testing.assert_allclose(
            strong.drives.torque_use * strong.peak_effort_nm, KR16.drives.torque_use * KR16.peak_effort_nm
        )
        assert bearing(KR16, 0.0) is KR16

    def test_torques_beyond_what_is_allowed_are_refused_by_name(self):
        run = rj.simulate(program(PICK), KR16)
        hot = replace(run, peak_torque_ratios=np.array([0.5, 1.27, 0.6]))
        with pytest.raises(InputError, match=r"move 'move-2' reaches 127\.0 % of its peak limit; allowed: up to 100 %"):
            check_torques(hot, 0.0)
        check_torques(hot, 27.0)

    @pytest.mark.parametrize("value", [-1, 1e3, "x", float("nan"), True])
    def test_no_overload(self, value):
        with pytest.raises(InputError, match="allow_overload_percent"):
            rj.optimize(program(PICK), KR16, cycle_time="+10%", allow_overload_percent=value)


class TestPeakPower:
    @pytest.mark.parametrize("power_w", [1500.0, 2500.0, 4000.0])
    @pytest.mark.parametrize("allow_faster", [False, True])
    def test_no_plan_draws_more(self, power_w, allow_faster):
        plan = rj.optimize(program(PICK), KR16, cycle_time=4.2, peak_power_w=power_w, allow_faster=allow_faster)
        assert plan.peak_power_w <= power_w
        assert rj.simulate(plan.program, KR16).peak_power_w <= power_w

    def test_it_costs_energy_or_nothing(self):
        free = rj.optimize(program(PICK), KR16, cycle_time=3.0)
        energies = [
            rj.optimize(program(PICK), KR16, cycle_time=3.0, peak_power_w=p).energy_j for p in (1900, 2500, 9000)
        ]
        assert energies[0] > free.energy_j
        assert energies[1:] == pytest.approx([free.energy_j] * 2, rel=1e-6)

    def test_the_bounds_are_the_highest_that_keep_it(self):
        """Against runs of the controller's simulation at every whole percent."""
        tree = program(PICK).tree
        batch = TreeBatch(KR16, [tree])
        limits = [move.speed_limit_percent for move in within_power(batch, tree, 2000.0).moves()]
        for row, limit in enumerate(limits):
            for percent in (limit, limit + 1.0):
                speeds = {move.name: percent if i == row else 10.0 for i, move in enumerate(tree.moves())}
                drawn = rj.simulate(rj.Program(tree.with_plan(speeds)), KR16).moves[row].peak_power_w
                assert (drawn <= 2000.0) == (percent == limit)

    def test_what_cannot_be_kept_is_told(self):
        with pytest.raises(
            InputError, match=r"^peak_power_w: move 'move-1' draws 643 W at its least speed limit, 10 %"
        ):
            rj.optimize(program(PICK), KR16, cycle_time=30, peak_power_w=500)
        with pytest.raises(CycleTimeTooShort, match=r"allowed: at least [\d.]+ s$"):
            rj.optimize(program(PICK), KR16, cycle_time=2.0, peak_power_w=1500)
        fixed = rj.Program(program(PICK).tree.with_settings({"move-1": {"speed_limit_percent": 90.0, "fixed": True}}))
        with pytest.raises(InputError, match=r"'move-1' draws .* at its least speed limit, 90 %"):
            rj.optimize(fixed, KR16, cycle_time=4, peak_power_w=1500)

    def test_process_steps_count(self, tmp_path):
        path = tmp_path / "weld.yaml"
        path.write_text(
            "format: robojoule-operation-tree\nversion: 1\nname: weld\nstart_deg: [0, -90, 90, 0, 0, 0]\noperations:\n"
            "  - {type: move, name: go, target_deg: [30, -80, 90, 0, 0, 0]}\n"
            "  - {type: process, name: weld, duration_s: 1, power_w: 5000}\n"
            "  - {type: move, name: back, target_deg: [0, -90, 90, 0, 0, 0]}\n"
        )
        with pytest.raises(InputError, match="standing still, process steps included, draws 54"):
            rj.optimize(rj.load_program(path), KR16, cycle_time="+60%", peak_power_w=3000)

    @pytest.mark.parametrize("value", [-1, 1e300, "x", float("nan"), True])
    def test_no_power(self, value):
        with pytest.raises(InputError, match="peak_power_w"):
            rj.optimize(program(PICK), KR16, cycle_time="+10%", peak_power_w=value)


class TestPaths:
    low = program([HOME, [0, 30, 60, 0, 0, 0], [90, 30, 60, 0, 0, 0], HOME])

    def test_what_touches_what_is_told_with_the_first_move(self):
        """As the model of capsules finds it, configuration by configuration."""
        points, model = self.low.tree.configurations_rad(), CollisionModel(KR16)
        found = collision_warnings(self.low.tree, KR16)
        paths = [path_points_rad(start, end) for start, end in pairwise(points)]
        touching = [
            {check for check, c in zip(model.checks, model.clearances_m(path).min(axis=0), strict=True) if c <= 0}
            for path in paths
        ]
        assert len(found) == len(set.union(*touching))
        for warning in found:
            one, rest = warning.split(" touches ")
            other, rest = rest.split(" in move ")
            moves = [i for i, pairs in enumerate(touching, start=1) if (one, other) in pairs]
            assert rest.startswith(f"'move-{moves[0]}'")
            assert ("and" in rest) == (len(moves) > 1)
        assert any(FLOOR in warning for warning in found)

    def test_every_result_that_leads_to_a_program_has_them(self):
        expected = collision_warnings(self.low.tree, KR16)
        assert set(expected) <= set(rj.optimize(self.low, KR16, cycle_time="+10%").warnings)
        assert set(expected) <= set(rj.pareto(self.low, KR16).warnings)

    def test_free_paths_and_robots_without_capsules_are_silent(self):
        assert collision_warnings(program(PICK).tree, KR16) == ()
        bare = rj.Robot(KR16.file.model_copy(update={"capsules": {}}))
        assert collision_warnings(self.low.tree, bare) == ()
