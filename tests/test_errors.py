"""Exceptions: the data of their case, their sentence, and their way between processes."""

import copy
import pickle

import pytest

from robojoule.errors import CycleTimeTooShort, InputError, MissingPackage, PlanningError, RobojouleError

ERRORS = [
    RobojouleError("nothing works"),
    InputError("it is wrong", file="a.yaml", key="b.c", allowed="what is right"),
    MissingPackage("a drawing", "matplotlib", "plot"),
    CycleTimeTooShort(4.1, 4.36),
    PlanningError("no plan"),
]


def test_cycle_time_message():
    error = CycleTimeTooShort(4.1, 4.36)
    assert (error.requested_s, error.minimum_s) == (4.1, 4.36)
    assert str(error) == "the cycle time 4.1 s is shorter than the fastest cycle; allowed: at least 4.360000 s"


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize("carried", [copy.deepcopy, lambda error: pickle.loads(pickle.dumps(error))])
def test_errors_travel_between_processes(error, carried):
    """A pool of processes in which one cannot be read again breaks, and none of its results arrives."""
    again = carried(error)
    assert type(again) is type(error)
    assert (str(again), again.args, vars(again)) == (str(error), error.args, vars(error))
