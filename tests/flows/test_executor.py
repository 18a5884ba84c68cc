"""Calls as tasks of a flow."""

import operator

import pytest
from prefect import flow

from flows.executor import TaskExecutor
from flows.runners import task_runner
from robojoule.errors import InputError, RobojouleError


@flow(persist_result=False)
def powers() -> list[int]:
    return list(TaskExecutor().map(operator.pow, range(5), [2] * 5))


@flow(persist_result=False)
def division() -> float:
    return TaskExecutor().submit(operator.truediv, 1.0, 0.0).result()


def test_calls_are_tasks_and_come_back_in_order(prefect_server: str):
    assert powers() == [0, 1, 4, 9, 16]
    with pytest.raises(ZeroDivisionError):
        division()


def refuse(value: int) -> None:
    raise InputError("no good", key=f"value {value}", allowed="none")


@flow(persist_result=False)
def refusal() -> None:
    TaskExecutor().submit(refuse, 3).result()


def test_an_error_comes_back_with_what_it_carries(prefect_server: str):
    with pytest.raises(InputError) as caught:
        refusal.with_options(task_runner=task_runner("processes", 1))()
    assert str(caught.value) == "value 3: no good; allowed: none"


def test_it_is_made_within_a_flow_only():
    with pytest.raises(RobojouleError, match="within a flow"):
        TaskExecutor()
