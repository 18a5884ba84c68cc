"""Motions out of logs of a hidden machine, and what they teach."""

import dataclasses

import numpy as np
import pyarrow as pa
import pytest

from reproduction.measured.motions import measured_motions
from reproduction.measured.predictor import predictor_of
from robojoule.errors import InputError
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload
from tests.calibration.plant import ROBOT, Plant, as_log, make_log, trajectory

ENTRY = load_robot(ROBOT, Payload(10.0))


@pytest.fixture(scope="module")
def rows() -> pa.Table:
    plant = Plant(21)
    logs = [as_log(make_log(plant, seed, motions=30)[0], f"log-{seed}.csv") for seed in (21, 22)]
    return pa.concat_tables([measured_motions(log, ENTRY) for log in logs])


def test_durations_and_energies_are_those_of_the_log():
    """Durations against the plant's own time law; the energies of motions and of the rests between make the whole."""
    plant = Plant(21)
    columns, power = make_log(plant, 21, motions=30, noise=0.0)
    table = measured_motions(as_log(columns), ENTRY)
    time, _, _, _, motion = trajectory(21, 30, name=plant.name)
    expected = [np.ptp(time[motion == number]) for number in range(30)]
    assert len(table) == 30
    np.testing.assert_allclose(table["duration_s"], expected, atol=0.03)
    moving = [np.trapezoid(power[motion == number], time[motion == number]) for number in range(30)]
    np.testing.assert_allclose(table["energy_j"], moving, rtol=0.03)


def test_a_log_may_name_its_payloads():
    """What it names counts, not what the robot is said to carry; a motion in which it changes is left out."""
    columns, _ = make_log(Plant(21), 21, motions=6)
    time, _, _, _, motion = trajectory(21, 6)
    middle = int(np.flatnonzero(motion == 2).mean())  # put down in the third one
    masses = np.where(np.arange(time.size) < middle, 2.0, 5.0)
    table = measured_motions(dataclasses.replace(as_log(columns), payload_kg=masses), ENTRY)
    assert table["payload_kg"].to_pylist() == [2.0, 2.0, 5.0, 5.0, 5.0]
    assert len(measured_motions(as_log(columns), ENTRY)) == 6


def test_payloads_are_of_the_same_shape(rows: pa.Table):
    """A long payload costs energy: other masses of it are as long, and the fit explains them alike."""
    long = load_robot(ROBOT, Payload(10.0, (0.0, 0.0, 0.3), (2.0, 2.0, 0.1)))
    half = rows.set_column(1, "payload_kg", pa.array(np.full(len(rows), 5.0)))
    assert predictor_of(long, half).error_percent != predictor_of(ENTRY, half).error_percent
    half_of_it = load_robot(ROBOT, Payload(5.0, (0.0, 0.0, 0.3), (1.0, 1.0, 0.05)))
    assert predictor_of(long, half).error_percent == predictor_of(half_of_it, half).error_percent


def test_a_machine_is_known_better_by_its_motions(rows: pa.Table):
    found = predictor_of(ENTRY, rows)
    assert found.is_accepted
    assert found.error_percent < 0.5 * found.entry_error_percent
    assert found.motions == len(rows) and f"{len(rows)} runs" in found.predictor.note


def test_few_motions_are_refused(rows: pa.Table):
    with pytest.raises(InputError, match="10 measured motions are too few; allowed: 15 or more"):
        predictor_of(ENTRY, rows.slice(0, 10))
