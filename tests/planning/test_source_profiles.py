"""Profiles of single motions by prediction and by measured runs of a hidden machine."""

import numpy as np
import pytest

import robojoule as rj
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.errors import InputError
from robojoule.programs.operation_tree import tree_from_configurations
from tests.calibration.machines import by_a_stopwatch, closed_cycle, joint_controller, observed
from tests.core_cases import kr16
from tests.planning.blended_trees import carrying, there_and_back

MOVE, ROW = "move-04", 3
ONE_RUN = MeasuredRuns("runs.csv", np.zeros(1, dtype=int), *np.ones((3, 1)), resolution_s=0.01)


@pytest.fixture(scope="module")
def cycle():
    paths, points = closed_cycle()
    return paths, rj.Program(tree_from_configurations("cycle", points, kr16().name)), points


@pytest.fixture(scope="module")
def runs(cycle):
    paths, _, _ = cycle
    return observed(paths, joint_controller(paths.robot), (1.0, 0.3))


def truth(cycle, limits):
    """What the hidden machine takes: durations and energies of the move."""
    found = cycle[0].with_controller(joint_controller(kr16())).simulate(limits)
    return found.duration_s[ROW], found.energy_j[ROW]


def test_measured_profiles_are_those_of_the_machine(cycle, runs):
    found = rj.energy_profile(kr16(), program=cycle[1], move=MOVE, runs=runs)
    duration, energy = truth(cycle, found.speed_limits)
    assert found.durations_s == pytest.approx(duration, rel=0.012)
    assert found.energies_j == pytest.approx(energy, rel=0.03)
    assert np.mean((found.low_j <= energy) & (energy <= found.high_j)) >= 0.8
    assert np.mean((found.low_s <= duration) & (duration <= found.high_s)) >= 0.8
    half = 0.5 * (found.high_s - found.low_s)
    stamped = np.isin(found.speed_limits, found.measured_speed_limits)
    assert half[stamped].max() < 0.008  # two stamps
    assert half.max() < 0.05 * found.durations_s.max()
    assert found.measured_speed_limits.tolist() == [0.3, 1.0]
    assert found.speed_limits.min() >= 0.85 * 0.3  # no profile much below what was measured
    simulated = rj.energy_profile(kr16(), program=cycle[1], move=MOVE)
    assert found.durations_s[-1] > 1.1 * simulated.durations_s[-1]  # the entry's controller is faster


def test_a_coarse_stamp_makes_a_duration_no_less_sure_than_it_is_without(cycle):
    paths, program, _ = cycle
    runs = by_a_stopwatch(paths, joint_controller(paths.robot), (1.0, 0.5, 0.25))
    profile = rj.energy_profile(kr16(), program=program, move=MOVE, runs=runs, points=40)
    width = profile.high_s - profile.low_s
    at = int(np.argmin(np.abs(profile.speed_limits - 0.5)))
    assert profile.speed_limits[at] in profile.measured_speed_limits
    assert 0.0 < width[at] <= 1.2 * max(width[at - 1], width[at + 1])


def test_runs_tell_simulated_profiles_the_timing_alone(cycle, runs):
    found = rj.energy_profile(kr16(), program=cycle[1], move=MOVE, runs=runs, profiles="simulated")
    duration, _ = truth(cycle, found.speed_limits)
    assert found.durations_s == pytest.approx(duration, rel=0.015)
    assert found.low_j is None and found.parts_j


def test_a_move_without_runs_is_predicted_from_those_of_others(cycle, runs):
    kept = runs.motion != ROW
    names = ("motion", "speed_limits", "duration_s", "energy_j")
    others = type(runs)("runs.csv", *(getattr(runs, name)[kept] for name in names), runs.resolution_s)
    with pytest.raises(InputError, match=rf"move '{MOVE}' has no run; allowed: runs of every move at two"):
        rj.energy_profile(kr16(), program=cycle[1], move=MOVE, runs=others)
    found = rj.energy_profile(kr16(), program=cycle[1], move=MOVE, runs=others, profiles="predicted")
    duration, energy = truth(cycle, found.speed_limits)
    assert found.durations_s == pytest.approx(duration, rel=0.02)
    assert found.energies_j == pytest.approx(energy, rel=0.03)


def test_predicted_profiles_hold_the_simulation_in_their_interval(cycle):
    ends = cycle[2][ROW], cycle[2][ROW + 1]
    found = rj.energy_profile(kr16(), *ends, profiles="predicted")
    simulated = rj.energy_profile(kr16(), *ends)
    assert found.durations_s == pytest.approx(simulated.durations_s, rel=1e-6)
    assert found.energies_j == pytest.approx(simulated.energies_j, rel=0.01)
    assert (found.low_j < found.energies_j).all() and (found.energies_j < found.high_j).all()
    assert found.peak_torque_ratio == simulated.peak_torque_ratio


@pytest.mark.parametrize(
    "named, message",
    [
        ({}, "a profile is that of a motion or of a move of a program; allowed: start and end, or program and move"),
        ({"move": MOVE}, "a profile is that of a motion or of a move"),
        ({"runs": "runs.csv"}, "a profile is that of a motion or of a move"),
        ({"program": True}, "which move of the program is not said"),
        ({"program": True, "move": "move-4"}, r"move: unknown move 'move-4' .did you mean move-04"),
        ({"program": True, "move": MOVE, "start": [0.0] * 6}, "a profile is that of a motion or of a move"),
        ({"program": True, "move": MOVE, "profiles": "measured"}, "measured profiles need measured runs"),
    ],
)
def test_what_does_not_go_together_is_refused(cycle, named, message):
    if "program" in named:
        named = named | {"program": cycle[1]}
    with pytest.raises(InputError, match=message):
        rj.energy_profile(kr16(), **named)


def test_a_motion_through_coarse_zones_has_one_profile():
    """Whatever move of it is named, and simulated in any case."""
    robot, given = kr16(), there_and_back({"radius_m": 0.08})
    run = rj.simulate(given, robot)
    for move in ("a", "b", "place"):
        found = rj.energy_profile(robot, program=given, move=move)
        assert found.durations_s[-1] == pytest.approx(run.durations_s[0])
        assert found.energies_j[-1] == pytest.approx(run.vertex_energies_j[0] - 0.3 * found.idle_power_end_w)
        assert "the profile is that of the whole motion through 'a' to 'place'" in found.warnings
    predicted = rj.energy_profile(robot, program=given, move="a", profiles="predicted")
    assert predicted.energies_j == pytest.approx(found.energies_j)
    assert any("predictors know straight motions only" in text for text in predicted.warnings)


@pytest.mark.parametrize("profiles", ["simulated", "predicted", "measured"])
def test_runs_of_motions_through_coarse_zones_are_refused_not_left_out(profiles):
    robot, given = kr16(), there_and_back({"radius_m": 0.08})
    with pytest.raises(InputError, match="move 'a' has a coarse zone"):
        rj.energy_profile(robot, program=given, move="a", runs=ONE_RUN, profiles=profiles)


def test_a_move_has_the_profile_of_what_is_carried():
    found = rj.energy_profile(kr16(5.0), program=carrying(), move="home")
    assert found.payload_kg == 2.0
    assert rj.energy_profile(kr16(5.0), program=carrying(), move="pick").payload_kg == 5.0
