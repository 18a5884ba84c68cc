"""Plans of programs with coarse zones, speed groups and changes of payload, through every function of the library."""

import itertools
import json

import numpy as np
import pytest

import robojoule as rj
from robojoule.errors import InputError
from robojoule.formats.program import WAIT_STEP_S
from robojoule.motion.simulation import MotionPaths
from robojoule.planning.batch import TreeBatch
from robojoule.planning.path_checks import collision_warnings
from robojoule.robots.robot import Payload
from tests.core_cases import kr16
from tests.planning.blended_trees import carrying, loop, move, program, there_and_back
from tests.planning.trees import HOME_DEG

PROGRAMS = {
    "radius": there_and_back({"radius_m": 0.08}),
    "share": there_and_back({"path_share": 0.3}),
    "payload": carrying(),
    "loop": loop(),
    "blended loop": loop({"radius_m": 0.05}),
}


@pytest.fixture(scope="module")
def robot():
    return kr16(5.0)


def some(*names):
    """Some of the programs as cases of a test."""
    return pytest.mark.parametrize("given", [PROGRAMS[name] for name in names], ids=names)


@pytest.mark.parametrize("given", PROGRAMS.values(), ids=PROGRAMS)
@pytest.mark.parametrize("more", ["+0%", "+12%"])
def test_a_plan_keeps_time_and_speeds_and_saves(robot, given, more):
    plan, run = rj.optimize(given, robot, cycle_time=more), rj.simulate(given, robot)
    asked = run.cycle_time_s * (1.0 + float(more.strip("+%")) / 100.0)
    assert asked - WAIT_STEP_S <= plan.cycle_time_s <= asked + 1e-6
    assert plan.energy_j <= plan.energy_given_j * (1.0 + 1e-9)
    assert 0.0 <= plan.gap_to_optimum_percent < 0.01
    again = rj.simulate(plan.program, robot)
    assert (again.energy_j, again.cycle_time_s) == pytest.approx((plan.energy_j, plan.cycle_time_s), rel=1e-12)
    for before, after in zip(given.moves, plan.program.moves, strict=True):
        assert after.speed_limit_percent <= before.speed_limit_percent
        assert after.speed_limit_percent == round(after.speed_limit_percent)
        assert before.is_fine or not after.all_after_s
    same = rj.optimize(plan.program, robot, cycle_time=plan.cycle_time_s)
    assert same.program.tree == plan.program.tree
    json.dumps(plan.to_dict(), allow_nan=False)


@some("radius", "blended loop")
def test_the_trade_off_is_that_of_the_plans(robot, given):
    curve = rj.pareto(given, robot)
    plan = rj.optimize(given, robot, cycle_time="+15%", speed_step=0.01)
    assert curve.curve.cycle_times_s[0] == pytest.approx(rj.simulate(given, robot).cycle_time_s)
    assert plan.energy_j == pytest.approx(float(curve.curve.energy_j(plan.cycle_time_s)), rel=2e-3)
    assert curve.largest_gap < 2e-3


def test_one_speed_limit_is_written_to_every_move_of_a_motion(robot):
    plan = rj.optimize(PROGRAMS["radius"], robot, cycle_time="+20%")
    percents = {m.name: m.speed_limit_percent for m in plan.program.moves}
    assert percents["a"] == percents["b"] == percents["place"] < 100.0
    assert percents["d"] == percents["home"]
    assert [m.speed_limit_percent for m in plan.moves] == [percents["place"], percents["home"]]


def test_moves_of_a_motion_keep_within_their_own_bounds(robot):
    a, b, c = ((30, -80, 85, 0, 15, 0), (55, -60, 80, 20, 30, 30), (80, -75, 95, 20, 10, 60))
    given = program(
        [
            move("slow", a, zone={"radius_m": 0.05}, speed_limit_percent=35.5),
            move("kept", b, zone={"radius_m": 0.05}, speed_limit_percent=62, fixed=True),
            move("not slower", c, zone={"radius_m": 0.05}, least_speed_percent=80),
            move("home", HOME_DEG),
        ]
    )
    plan = rj.optimize(given, robot, cycle_time="+8%")
    percents = [m.speed_limit_percent for m in plan.program.moves]
    assert percents[:2] == [35.5, 62.0]
    assert percents[2] == 80.0
    assert 36.0 <= percents[3] < 80.0
    faster = rj.optimize(given, robot, cycle_time=rj.simulate(given, robot).cycle_time_s, allow_faster=True)
    assert faster.program.moves[1].speed_limit_percent == 62.0
    assert faster.energy_j <= plan.energy_given_j


def test_a_speed_group_has_the_best_of_all_its_speed_limits(robot):
    """Against every combination of whole percents of the three decisions of the loop."""
    given = PROGRAMS["loop"]
    plan = rj.optimize(given, robot, cycle_time="+12%")
    percents = [m.speed_limit_percent for m in plan.program.moves]
    assert percents[0] == percents[2]
    assert percents[1] == percents[3]
    points = given.tree.configurations_rad()
    paths = MotionPaths(robot, points[:-1], points[1:])
    grid = np.arange(10, 101)
    runs = paths.simulate(grid / 100.0)
    groups = ([0, 2], [1, 3], [4])
    times, energies = ([values[rows].sum(axis=0) for rows in groups] for values in (runs.duration_s, runs.energy_j))
    idle = min(paths.idle_power_start_w.min(), paths.idle_power_end_w.min())
    total_s = sum(np.ix_(*times))
    total_j = sum(np.ix_(*energies)) + idle * (plan.cycle_time_s - total_s)
    best = np.where(total_s <= plan.cycle_time_s + 1e-9, total_j, np.inf).min()
    assert plan.energy_j == pytest.approx(best, rel=1e-5)


def test_a_group_costs_what_it_ties(robot):
    """The tied optimum is above the free one, and below that of uniform speeds."""
    tied = PROGRAMS["loop"]
    free = rj.Program(tied.tree.with_settings({m.name: {"speed_group": None} for m in tied.moves}))
    plans = [rj.optimize(one, robot, cycle_time="+15%").energy_j for one in (tied, free)]
    assert plans[1] < plans[0]


@some("share", "blended loop")
def test_a_largest_power_is_kept(robot, given):
    free = rj.optimize(given, robot, cycle_time="+30%")
    bound = 0.9 * free.peak_power_w
    plan = rj.optimize(given, robot, cycle_time="+60%", peak_power_w=bound)
    assert plan.peak_power_w <= bound
    with pytest.raises(InputError, match="peak_power_w"):
        rj.optimize(given, robot, cycle_time="+60%", peak_power_w=100.0)


@some("radius", "payload", "loop")
def test_predicted_plans_say_what_was_simulated(robot, given):
    """Predictions of an untrained robot are its nominal physics: the plan is nearly the simulated one."""
    arm = rj.load_robot("kuka_kr10_r1100_2", payload_kg=2.0)
    light = rj.Program(given.tree.with_settings({})) if given.name != "carrying" else None
    if light is None:
        operations = [o for o in given.tree.model_dump()["operations"] if o["type"] != "payload"]
        light = program([*operations[:2], {"type": "payload", "name": "grip", "mass_kg": 6.0}, *operations[2:]])
    plan = rj.optimize(light, arm, cycle_time="+15%", profiles="predicted")
    simulated = rj.optimize(light, arm, cycle_time="+15%")
    assert plan.energy_j == pytest.approx(simulated.energy_j, rel=2e-3)
    coarse = sum(len(v.moves) > 1 for v in TreeBatch(arm, [light.tree]).graphs[0].vertices)
    said = [warning for warning in plan.warnings if "coarse zone" in warning]
    assert len(said) == (1 if coarse else 0)
    if coarse:
        assert said[0].startswith(f"{coarse} motion")
    assert plan.outlook.saving_low_percent < plan.saving_percent < plan.outlook.saving_high_percent
    rj.optimize(light, arm, cycle_time="+15%", profiles="predicted", cautious=True)


@some("payload", "blended loop")
def test_a_plan_is_adjusted_to_a_slower_machine(robot, given):
    plan = rj.optimize(given, robot, cycle_time="+20%")
    again = rj.adjust(plan.program, robot, measured_cycle=1.04 * plan.cycle_time_s)
    assert again.cycle_time_s == pytest.approx(plan.cycle_time_s, abs=WAIT_STEP_S)
    assert again.energy_j > plan.energy_j


@some("payload", "loop")
def test_the_page_shows_the_energy_of_the_plan(robot, given):
    plan = rj.optimize(given, robot, cycle_time="+10%")
    shown = rj.report(plan, given, robot)
    assert sum(shown.planned.parts_j.values()) == pytest.approx(plan.energy_j, rel=1e-9)
    moved = sum(step.end_s - step.start_s for step in shown.planned.steps if step.kind == "move")
    assert moved == pytest.approx(float(plan.run.durations_s.sum()))
    assert shown.planned.power_w.max() == pytest.approx(plan.peak_power_w, rel=0.05)
    assert len(shown.page()) < 500_000


@pytest.mark.parametrize("suffix", [".yaml", ".json"])
def test_a_plan_is_saved_into_the_text(robot, tmp_path, suffix):
    path, given = tmp_path / f"cell{suffix}", PROGRAMS["payload"]
    given.save(path)
    plan = rj.optimize(rj.load_program(path), robot, cycle_time="+10%")
    plan.save(path)
    again = rj.load_program(path)
    assert again.tree == plan.program.tree
    assert rj.simulate(again, robot).energy_j == pytest.approx(plan.energy_j)
    text = path.read_text()
    assert "path_share" in text
    assert "mass_kg" in text


def test_torques_beyond_the_limit_are_refused(robot):
    """A far reach with the largest payload, as it comes up in the middle of a blended motion."""
    weak = robot.variant(peak_effort_nm=robot.peak_effort_nm * np.array([1, 0.35, 1, 1, 1, 1]))
    with pytest.raises(InputError, match="joint_2 of kuka_kr16_r2010_2 cannot move the arm"):
        rj.optimize(
            program([move("out", (0, 0, 0, 0, 0, 0), zone={"radius_m": 0.1}), move("home", HOME_DEG)]),
            weak.carrying(Payload(16.0)),
            cycle_time="+10%",
        )
    allowed = rj.optimize(PROGRAMS["radius"], robot, cycle_time="+10%", allow_overload_percent=20.0)
    assert allowed.peak_torque_ratio <= 1.0


def test_collisions_are_looked_for_on_the_rounded_path():
    """A point under the floor, and one that a wide zone keeps above it."""
    robot = kr16(10.0)
    down = (0, -10, 100, 0, 0, 0)
    over, under = ((0, -60, 90, 0, 0, 0), (0, -20, 110, 0, 0, 0))
    fine = program([move("over", over), move("under", under), move("down", down), move("home", HOME_DEG)])
    assert collision_warnings(fine.tree, robot)
    through = [
        program([move("under", under, zone=zone), move("home", (40, -90, 90, 0, 0, 0))])
        for zone in ("fine", {"path_share": 0.5})
    ]
    depths = [
        [float(text.split(" by up to ")[1].split()[0]) for text in collision_warnings(one.tree, robot)]
        for one in through
    ]
    assert max(depths[0]) > max(depths[1], default=0.0)


def test_a_program_of_many_blended_moves_is_planned():
    """As public body-shop programs are: 21 joint moves, 17 of them rounded."""
    robot, rng = rj.load_robot("fanuc_r2000ic_165f", payload_kg=60.0), np.random.default_rng(4)
    steps = robot.home_rad + np.cumsum(rng.normal(0.0, 0.2, (21, robot.joint_count)), axis=0)
    points = np.degrees(np.clip(steps, robot.lower_rad + 0.05, robot.upper_rad - 0.05))
    points[-1] = np.degrees(robot.home_rad)
    stops = {5, 9, 14, 20}
    moves = [move(f"P[{k}]", q, **({} if k in stops else {"zone": {"path_share": 0.5}})) for k, q in enumerate(points)]
    given = program(moves, "body shop")
    given = rj.Program(given.tree.model_copy(update={"start_rad": tuple(robot.home_rad)}))
    plan = rj.optimize(given, robot, cycle_time="+10%")
    assert len(plan.moves) == 4
    assert sum(len(m.through) for m in plan.moves) == 17
    assert plan.saving_percent > 3.0
    assert plan.peak_torque_ratio <= 1.0


def test_all_kinds_of_zone_are_written_and_read_back(tmp_path):
    for given, suffix in itertools.product(PROGRAMS.values(), (".yaml", ".json")):
        given.save(tmp_path / f"tree{suffix}")
        assert rj.load_program(tmp_path / f"tree{suffix}").tree == given.tree


def test_a_cycle_in_sections_keeps_its_motions_and_groups(robot):
    """A wait for a signal in the middle: what is tied over it keeps its speed, and the plan says so."""
    operations = list(PROGRAMS["payload"].tree.model_dump()["operations"])
    for place in (0, -1):
        operations[place]["speed_group"] = "both"
    operations.insert(4, {"type": "unknown", "name": "signal"})
    plan = rj.optimize(program(operations), robot, cycle_time="+15%")
    assert [one.through for one in plan.moves] == [("a",), ("c",), ()]
    assert "speed group 'both' has moves in several sections: its speed is kept" in plan.warnings
    percents = {m.name: m.speed_limit_percent for m in plan.program.moves}
    assert percents["a"] == percents["home"] == 100.0
    assert percents["pick"] < 100.0
    assert percents["c"] == percents["place"] < 100.0
