"""Parts of a stage: in order, computed anywhere, kept until the outputs are there."""

import operator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

from reproduction.layout import Layout
from reproduction.parts import HERE, Parts
from reproduction.study import regimes
from robojoule.errors import InputError
from tests.reproduction.study.cases import small_study

TASKS = [(number, 2) for number in range(5)]


class Refusing(Executor):
    """An executor that must not be asked."""

    def submit(self, fn, /, *args, **kwargs) -> Future:
        raise AssertionError("nothing may be computed")


def odd(number: int) -> int:
    if number % 2 == 0:
        raise InputError("an even number", key=str(number))
    return number


@pytest.mark.parametrize("where", [HERE, Parts(executor=ThreadPoolExecutor(2)), Parts(workers=2)])
def test_results_come_in_the_order_of_the_tasks(where: Parts):
    told: list[tuple[int, int]] = []
    assert where.map(operator.pow, TASKS, lambda number, result: told.append((number, result))) == [0, 1, 4, 9, 16]
    assert sorted(told) == list(enumerate([0, 1, 4, 9, 16]))


def test_what_was_computed_is_kept_until_it_is_forgotten(tmp_path: Path):
    layout = Layout(tmp_path)
    parts = Parts.of_stage("example", layout, {"a": 1}, [b"input"], ThreadPoolExecutor(1))
    assert parts.map(operator.pow, TASKS) == [0, 1, 4, 9, 16]
    again = Parts.of_stage("example", layout, {"a": 1}, [b"input"], Refusing())
    assert again.map(operator.pow, TASKS) == [0, 1, 4, 9, 16]
    with pytest.raises(AssertionError, match="nothing may be computed"):
        again.map(operator.mul, TASKS)
    for params, inputs in (({"a": 2}, [b"input"]), ({"a": 1}, [b"other"])):
        with pytest.raises(AssertionError, match="nothing may be computed"):
            Parts.of_stage("example", layout, params, inputs, Refusing()).map(operator.pow, TASKS)
    again.forget()
    assert not again.folder.exists()


def test_a_part_that_fails_costs_no_other(tmp_path: Path):
    with pytest.raises(InputError, match="0: an even number"):
        Parts(tmp_path, ThreadPoolExecutor(1)).map(odd, [(1,), (3,), (0,)])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["odd-0000.part", "odd-0001.part"]


@pytest.mark.parametrize(
    "study",
    [regimes.same_robot, regimes.unseen_payload, regimes.unseen_robot],
    ids=lambda study: study.__name__,
)
def test_a_study_does_not_depend_on_who_computes_its_parts(study, tmp_path: Path):
    params = small_study()
    here = study(params, lambda text: None)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        assert study(params, lambda text: None, Parts(tmp_path, pool)) == here
    assert study(params, lambda text: None, Parts(tmp_path, Refusing())) == here
