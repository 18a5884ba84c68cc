"""What the door returns: it cannot be changed, can be compared and copied, and is shown in one line."""

import copy
import json
import pickle
from collections.abc import Iterator
from dataclasses import FrozenInstanceError, fields, is_dataclass

import numpy as np
import pytest

import robojoule as rj
from robojoule.programs.operation_tree import tree_from_configurations
from tests.calibration.plant import ROBOT, Plant, make_log

STOPS_DEG = [[0, -90, 90, 0, 0, 0], [50, -70, 80, 0, 30, 0], [0, -90, 90, 0, 0, 0]]


@pytest.fixture(scope="module")
def given(tmp_path_factory) -> dict[str, object]:
    """One of everything that the door returns and takes."""
    payload = rj.Payload(10.0, inertia_kg_m2=np.eye(3))
    robot = rj.load_robot(ROBOT, payload)
    program = rj.Program(tree_from_configurations("pick", np.radians(STOPS_DEG)))
    columns, _ = make_log(Plant(22), 22, motions=12)
    log = tmp_path_factory.mktemp("logs") / "log.csv"
    np.savetxt(log, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="")
    return {
        "payload": payload,
        "robot": robot,
        "program": program,
        "plan": rj.optimize(program, robot, cycle_time="+10%"),
        "cycle": rj.simulate(program, robot),
        "trade-off": rj.pareto(program, robot),
        "profile": rj.energy_profile(robot, STOPS_DEG[0], STOPS_DEG[1], degrees=True),
        "identification": rj.identify(log, robot),
    }


NAMES = ("payload", "robot", "program", "plan", "cycle", "trade-off", "profile", "identification")


def parts(value: object, place: str) -> Iterator[tuple[str, object]]:
    """A value and all that it holds, each with its place."""
    yield place, value
    if is_dataclass(value):
        for field in fields(value):
            yield from parts(getattr(value, field.name), f"{place}.{field.name}")
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from parts(inner, f"{place}[{key!r}]")
    elif isinstance(value, tuple):
        for number, inner in enumerate(value):
            yield from parts(inner, f"{place}[{number}]")


@pytest.mark.parametrize("name", NAMES)
def test_nothing_of_it_can_be_changed(given, name):
    for place, part in parts(given[name], name):
        assert not isinstance(part, list | set), place
        if isinstance(part, np.ndarray):
            assert not part.flags.writeable, place
        if is_dataclass(part):
            with pytest.raises(FrozenInstanceError):
                setattr(part, fields(part)[0].name, None)


@pytest.mark.parametrize("name", NAMES)
def test_everything_can_be_compared_hashed_and_copied(given, name):
    for place, part in parts(given[name], name):
        if is_dataclass(part):
            assert (part == copy.copy(part)) in (True, False), place
            assert hash(part) == hash(part), place
    assert repr(copy.deepcopy(given[name])) == repr(given[name])
    assert repr(pickle.loads(pickle.dumps(given[name]))) == repr(given[name])


@pytest.mark.parametrize("name", NAMES)
def test_it_is_shown_in_one_line(given, name):
    assert "\n" not in repr(given[name])
    assert len(repr(given[name])) < 250


@pytest.mark.parametrize("name", ["plan", "cycle", "trade-off", "profile", "identification"])
def test_results_are_plain_data_too(given, name):
    assert json.loads(json.dumps(given[name].to_dict(), allow_nan=False))


def test_payloads_are_equal_if_all_of_them_is():
    own, other = ((rj.Payload(3.0, inertia_kg_m2=share * np.eye(3))) for share in (1.0, 2.0))
    assert own == rj.Payload(3.0, inertia_kg_m2=[[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert own != other
    assert own != rj.Payload(3.0)
