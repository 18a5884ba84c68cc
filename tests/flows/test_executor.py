"""Calls as tasks of a flow."""

import operator
from pathlib import Path

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


def tried(folder: Path) -> int:
    """Fails at the first try, as on a worker whose disk is full."""
    count = len(list(folder.iterdir()))
    (folder / str(count)).touch()
    if count == 0:
        raise OSError("no space left")
    return count


@flow(persist_result=False)
def second_try(folder: Path) -> int:
    return TaskExecutor().submit(tried, folder).result()


def test_a_fault_of_the_machine_is_tried_once_more(prefect_server: str, tmp_path: Path):
    assert second_try(tmp_path) == 1


def refuse(value: int, folder: Path) -> None:
    (folder / str(len(list(folder.iterdir())))).touch()
    raise InputError("no good", key=f"value {value}", allowed="none")


@flow(persist_result=False)
def refusal(folder: Path) -> None:
    TaskExecutor().submit(refuse, 3, folder).result()


def test_an_error_comes_back_with_what_it_carries(prefect_server: str, tmp_path: Path):
    with pytest.raises(InputError) as caught:
        refusal.with_options(task_runner=task_runner("processes", 1))(tmp_path)
    assert str(caught.value) == "value 3: no good; allowed: none"
    assert len(list(tmp_path.iterdir())) == 1  # bad input is not tried again


def test_it_is_made_within_a_flow_only():
    with pytest.raises(RobojouleError, match="within a flow"):
        TaskExecutor()
