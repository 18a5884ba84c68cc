"""The functions of the library: what a plan is compared with, how results agree, bad input."""

import json

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import csv

import robojoule as rj
from robojoule.calibration.log import MeasuredLog
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.formats.program import WAIT_STEP_S, Program
from robojoule.planning.batch import TreeBatch
from robojoule.programs.operation_tree import tree_from_configurations
from tests.calibration.plant import ROBOT, Plant, make_log
from tests.planning.trees import busy_tree, tree

STOPS_DEG = [[0, -90, 90, 0, 0, 0], [50, -70, 80, 0, 30, 0], [-20, -60, 100, 40, 0, 0], [0, -90, 90, 0, 0, 0]]
PROGRAM = Program(tree_from_configurations("pick", np.radians(STOPS_DEG)))


@pytest.fixture(scope="module")
def robot():
    return rj.load_robot(ROBOT, payload_kg=10)


def changed(limit=100.0, **waits) -> Program:
    """The program with another speed limit of its first move, and waits."""
    return Program(PROGRAM.tree.with_plan({"move-1": limit}, **waits))


class TestOptimize:
    def test_a_share_is_one_of_the_program_as_given(self, robot):
        """Its waits and its slow move included."""
        given = changed(30.0, waits_after_s={"move-2": 0.5})
        as_given = rj.simulate(given, robot)
        plan = rj.optimize(given, robot, cycle_time="+10%", allow_faster=True)
        assert plan.cycle_time_s == pytest.approx(1.1 * as_given.cycle_time_s, abs=WAIT_STEP_S)
        assert plan.least_cycle_time_s < as_given.cycle_time_s - 0.1
        assert plan.moves[1].wait_after_s >= 0.5
        home_w = TreeBatch(robot, [given.tree]).idle_post_w[-1]
        waited = as_given.energy_j + home_w * (plan.cycle_time_s - as_given.cycle_time_s)
        assert plan.energy_given_j == pytest.approx(waited, rel=1e-9)

    def test_the_same_cycle_time_is_used_better(self, robot):
        given = changed(25.0)
        plan = rj.optimize(given, robot, cycle_time="+0%", allow_faster=True)
        as_given = rj.simulate(given, robot)
        assert plan.cycle_time_s == pytest.approx(as_given.cycle_time_s, abs=WAIT_STEP_S)
        assert plan.energy_given_j == pytest.approx(as_given.energy_j, rel=1e-9)
        assert plan.saving_percent > 1.0
        assert plan.energy_unoptimized_j > plan.energy_j

    def test_full_speed_then_waiting_is_the_other_reference(self, robot):
        plan = rj.optimize(changed(30.0), robot, cycle_time=4.0)
        last = PROGRAM.moves[-1].name
        fastest = rj.simulate(PROGRAM, robot)
        waiting = changed(100.0, waits_after_s={last: plan.cycle_time_s - fastest.cycle_time_s})
        assert plan.energy_unoptimized_j == pytest.approx(rj.simulate(waiting, robot).energy_j, rel=1e-9)
        assert plan.least_cycle_time_s == pytest.approx(rj.simulate(changed(30.0), robot).cycle_time_s, rel=1e-12)
        faster = rj.optimize(changed(30.0), robot, cycle_time=4.0, allow_faster=True)
        assert faster.least_cycle_time_s == pytest.approx(fastest.cycle_time_s, rel=1e-12)

    def test_a_program_slower_than_asked_counts_with_its_own_cycle(self, robot):
        slow = Program(PROGRAM.tree.with_plan({move.name: 10.0 for move in PROGRAM.moves}))
        as_given = rj.simulate(slow, robot)
        plan = rj.optimize(slow, robot, cycle_time=as_given.cycle_time_s / 2.0, allow_faster=True)
        assert plan.cycle_time_s == pytest.approx(as_given.cycle_time_s / 2.0, abs=WAIT_STEP_S)
        assert plan.energy_given_j == as_given.energy_j
        assert "longer than the plan" in plan.warnings[0]

    def test_the_least_speed_limit_bounds_the_plan(self, robot):
        """Within a wider bound no plan is worse; where waiting costs less than a slow run, both are the same."""
        free, bound = (
            rj.optimize(PROGRAM, robot, cycle_time="+150%", slowest_speed_limit_percent=percent)
            for percent in (1.0, 60.0)
        )
        assert min(move.speed_limit_percent for move in bound.moves) >= 60.0 - 1e-6
        assert min(move.speed_limit_percent for move in free.moves) < 60.0
        assert free.energy_j < bound.energy_j
        curves = [rj.pareto(PROGRAM, robot, slowest_speed_limit_percent=percent).curve for percent in (1.0, 60.0)]
        at = [curve.energy_j(np.array([bound.cycle_time_s]))[0] for curve in curves]
        assert at == pytest.approx([free.energy_j, bound.energy_j], rel=2e-3)  # whole percents

    @pytest.mark.parametrize("percent", [0.0, -1.0, 101.0, float("nan"), "10"])
    def test_a_least_speed_limit_out_of_range_is_refused(self, robot, percent):
        for ask in (
            lambda: rj.pareto(PROGRAM, robot, slowest_speed_limit_percent=percent),
            lambda: rj.optimize(PROGRAM, robot, cycle_time="+10%", slowest_speed_limit_percent=percent),
        ):
            with pytest.raises(InputError, match=r"slowest_speed_limit_percent.*0\.01 to 100 %"):
                ask()

    @pytest.mark.parametrize("program", [PROGRAM, Program(tree()), Program(busy_tree())], ids=lambda p: p.name)
    @pytest.mark.parametrize("share", ["+0%", "+15%", "+300%"])
    def test_no_plan_is_far_from_its_bound(self, robot, program, share):
        plan = rj.optimize(program, robot, cycle_time=share)
        assert plan.bound_j <= plan.energy_j
        assert 0.0 <= plan.gap_to_optimum_percent <= 0.02
        assert plan.energy_j <= plan.energy_unoptimized_j * (1.0 + 1e-9)
        assert plan.warnings == ()

    def test_what_is_said_is_what_the_written_program_does(self, robot, tmp_path):
        plan = rj.optimize(PROGRAM, robot, cycle_time="+20%")
        for name in ("plan.yaml", "plan.json", "plan.csv"):
            plan.save(tmp_path / name)
            run = rj.simulate(rj.load_program(tmp_path / name), robot)
            assert run.to_dict() == {name: plan.to_dict()[name] for name in run.to_dict()}

    def test_the_least_cycle_time_that_a_message_names_is_feasible(self, robot):
        with pytest.raises(CycleTimeTooShort) as caught:
            rj.optimize(PROGRAM, robot, cycle_time=1.0)
        named = str(caught.value).rsplit("at least ", 1)[1].removesuffix(" s")
        plan = rj.optimize(PROGRAM, robot, cycle_time=named)
        assert plan.cycle_time_s == pytest.approx(float(named), abs=1e-6)

    def test_more_payload_takes_more_energy(self):
        light, heavy = (rj.load_robot(ROBOT, payload_kg=mass) for mass in (0, 16))
        assert light.payload == rj.Payload()
        energies = [rj.optimize(PROGRAM, robot, cycle_time=4).energy_j for robot in (light, heavy)]
        assert energies[0] < energies[1]


def test_the_curve_meets_the_plans(robot):
    curve = rj.pareto(PROGRAM, robot)
    for share in ("+5%", "+40%"):
        plan = rj.optimize(PROGRAM, robot, cycle_time=share, speed_step=0.01)
        assert curve.curve.energy_j(plan.cycle_time_s) == pytest.approx(plan.energy_j, rel=5e-4)
        assert curve.bound.energy_j(plan.cycle_time_s) <= plan.energy_j
    least, waiting = (curve.to_dict(until=until)["points"] for until in ("least", "waiting"))
    assert waiting[: len(least)] == least
    assert least[-1]["energy_j"] == min(point["energy_j"] for point in waiting)
    assert json.loads(json.dumps(curve.to_dict(), allow_nan=False))["moves"] == 3
    assert repr(curve).startswith(f"TradeOff('pick' on '{ROBOT}': ")


def test_a_profile_in_degrees_is_one_in_radians(robot):
    in_degrees = rj.energy_profile(robot, STOPS_DEG[0], STOPS_DEG[1], degrees=True)
    in_radians = rj.energy_profile(robot, *np.radians(STOPS_DEG[:2]))
    assert in_degrees.to_dict() == in_radians.to_dict()


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    columns, _ = make_log(Plant(21), 21, motions=20)
    path = tmp_path_factory.mktemp("logs") / "log.csv"
    csv.write_csv(pa.table(columns), path)
    return path


def test_identification_takes_a_file_or_a_log(log, robot):
    from robojoule.calibration.log import read_log

    found = rj.identify(log, robot)
    data = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    again = rj.identify(read_log(log, robot), robot, window_s=0.1).to_dict()
    for one, other in zip(data["parameters"], again["parameters"], strict=True):
        assert one["name"] == other["name"]
        assert one["value"] == pytest.approx(other["value"], rel=1e-6)
    assert (data["log"], data["robot"]) == (str(log), ROBOT)
    (warning,) = data["warnings"]
    assert warning.startswith("no timing by the log's motions: without a column speed_limit_percent")
    assert repr(found).startswith(f"Identification('{ROBOT}' from '{log}': parameters=")


ELSEWHERE = Program(tree_from_configurations("far", np.radians([STOPS_DEG[0], [0, 90, 0, 0, 0, 0]])))
FOR_ANOTHER = Program(tree_from_configurations("other", np.radians(STOPS_DEG), "ur_ur10e"))
NO_POWER = MeasuredLog("log", np.arange(9.0), np.zeros((9, 6)), np.full(9, np.nan), has_power=False)
HOME, SHORT, FAR = np.radians(STOPS_DEG[0]), [0.0, 0.0], [0, 90, 0, 0, 0, 0]
BAD = {
    "path for program": (
        lambda r: rj.optimize("cycle.yaml", r, cycle_time=4),
        "program: 'cycle.yaml' is not a program",
    ),
    "name for robot": (lambda r: rj.simulate(PROGRAM, ROBOT), f"robot: '{ROBOT}' is not a robot; allowed: what load"),
    "beyond a limit": (lambda r: rj.pareto(ELSEWHERE, r), "operations.0.target_rad: move 'move-1': joint_2 = 1.5708"),
    "another robot": (lambda r: rj.simulate(FOR_ANOTHER, r), "robot: the tree is written for robot 'ur_ur10e', not"),
    "cycle time": (lambda r: rj.optimize(PROGRAM, r, cycle_time="soon"), "cycle_time: 'soon' is not a valid cycle"),
    "too short": (lambda r: rj.optimize(PROGRAM, r, cycle_time=1), "the cycle time 1 s is shorter than the fastest"),
    "joints": (lambda r: rj.energy_profile(r, HOME, SHORT), "end: 2 joint positions given, but"),
    "joint limit": (lambda r: rj.energy_profile(r, FAR, HOME, degrees=True), "start: joint_2 = 1.5708 rad (90 deg)"),
    "words": (lambda r: rj.energy_profile(r, "home", HOME, degrees=True), "start: joint positions must be numbers"),
    "not a number": (lambda r: rj.energy_profile(r, HOME, HOME * np.nan), "end: joint_1 is not a finite number"),
    "no motion": (lambda r: rj.energy_profile(r, HOME, HOME), "start and end are the same: there is no motion"),
    "points": (lambda r: rj.energy_profile(r, HOME, 0 * HOME, points=1), "points: 1 is not a valid number of points"),
    "log": (lambda r: rj.identify("none.csv", r), "none.csv: there is no such file"),
    "log type": (
        lambda r: rj.identify("log.xlsx", r),
        "log.xlsx: unknown file type '.xlsx'; allowed: .csv, .tsv, .txt, .csv.gz",
    ),
    "log without power": (
        lambda r: rj.identify(NO_POWER, r),
        "log, power_w: the log holds no power; allowed: power, or identify_friction for torques",
    ),
    "no profile": (lambda r: rj.energy_profile(r), "program: a profile is that of a motion or of a move of a"),
    "trial twice": (
        lambda r: rj.adjust(PROGRAM, r, measured_cycle=3, runs="runs.csv"),
        "measured_cycle: both a measured cycle and runs are given; allowed: one of them; runs tell more",
    ),
    "file": (lambda r: rj.load_program("none.csv"), "none.csv: there is no such file"),
    "robot": (lambda r: rj.load_robot("kr17"), "unknown robot 'kr17' (did you mean "),
    "payload": (
        lambda r: rj.load_robot(ROBOT, payload_kg=-1),
        "payload: -1 is not a valid payload mass; allowed: 0 kg",
    ),
}


@pytest.mark.parametrize("call, message", BAD.values(), ids=BAD.keys())
def test_bad_input_is_one_sentence(robot, call, message):
    with pytest.raises(InputError) as caught:
        call(robot)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_measured_runs_of_coarse_moves_are_refused(robot):
    moves = tree().model_dump()["operations"]
    moves[0]["zone"] = {"radius_m": 0.1}
    rounded = Program(type(tree()).model_validate({**tree().model_dump(), "operations": moves}))
    assert rj.simulate(rounded, robot).cycle_time_s < rj.simulate(Program(tree()), robot).cycle_time_s
    runs = MeasuredRuns(
        "runs.csv", np.array([1, 1]), np.array([1.0, 0.5]), np.array([1.0, 2.0]), np.full(2, np.nan), 0.01
    )
    with pytest.raises(InputError, match="move 'm0' has a coarse zone"):
        rj.optimize(rounded, robot, cycle_time="+10%", runs=runs)
