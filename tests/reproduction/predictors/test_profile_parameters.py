from __future__ import annotations

import numpy as np

from reproduction.predictors.profile_parameters import bounded, input_names, joint_count
from robojoule.profile.parameters import TARGETS


def test_inputs_are_the_thesis_s() -> None:
    expected = ["vertical_distance_m", "horizontal_distance_m", "rotation_angle_rad"]
    for joint in range(1, 7):
        expected += [
            f"j{joint}_angle_difference_rad",
            f"j{joint}_speed_difference_rad_s",
            f"j{joint}_acceleration_difference_rad_s2",
            f"j{joint}_deceleration_difference_rad_s2",
            f"j{joint}_jerk_acceleration_difference_rad_s3",
            f"j{joint}_jerk_deceleration_difference_rad_s3",
        ]
    assert list(input_names()) == expected
    assert len(expected) == 39
    assert not {"euclidean_distance_m", "theta_sum_rad", *TARGETS} & set(expected)
    assert len(input_names(7)) == 45


def test_the_joints_are_counted_by_their_inputs() -> None:
    for joints in (1, 6, 7):
        assert joint_count(["tree_id", *reversed(input_names(joints))]) == joints
    assert joint_count(["tree_id", "j2_angle_difference_rad"]) == 0


def test_targets_are_the_three_parameters() -> None:
    assert TARGETS == ("energy_saving_j", "optimal_duration_s", "energy_penalty_j")


def test_bounded_keeps_what_is_possible_and_moves_the_rest() -> None:
    fastest, slowest = np.array([1.0, 1.0, 1.0]), np.array([4.0, 4.0, 4.0])
    raw = np.array([[5.0, 2.0, 9.0], [-5.0, 0.5, -1.0], [0.0, 7.0, 0.0]])
    assert bounded(raw, fastest, slowest).tolist() == [[5.0, 2.0, 9.0], [0.0, 1.0, 0.0], [0.0, 4.0, 0.0]]
    assert raw[1, 0] == -5.0
