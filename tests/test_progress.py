"""How far work is: who hears it, what is told, and the time that is left."""

import pytest

import robojoule as rj
from robojoule.errors import InputError
from robojoule.progress import Progress, tell, telling, told, within


def test_work_is_heard_by_the_nearest_listener():
    outer, inner = [], []
    tell("nobody listens", 0, 1)
    with telling(outer.append):
        tell("a", 1, 4)
        with telling(inner.append), within("section 2 of 5"):
            tell("b", 2, 4)
        with telling(None), within("x"), within("y"):
            assert list(told("c", [7, 8])) == [7, 8]
        tell("d", 3, 4)
    tell("nobody listens", 1, 1)
    assert inner == [Progress("section 2 of 5, b", 2, 4)]
    assert [(one.work, one.done, one.total) for one in outer] == [
        ("a", 1, 4),
        *(("x, y, c", done, 2) for done in (0, 1, 2)),
        ("d", 3, 4),
    ]


def test_what_cannot_be_called_is_refused():
    with pytest.raises(InputError, match="progress: 3 cannot be called"), telling(3):
        pass


def test_time_left_goes_on_at_the_pace_so_far():
    assert Progress("runs", 25.0, 100.0).left_s(5.0) == pytest.approx(15.0)
    assert Progress("runs", 60.0, 100.0).left_s(5.0, done_before=50.0) == pytest.approx(20.0)
    assert Progress("runs", 100.0, 100.0).left_s(5.0) == 0.0
    assert Progress("runs", 1.0, 100.0).left_s(5.0) is None
    assert Progress("runs", 0.0, 0.0).left_s(5.0) is None
    assert Progress("runs", 2.7, 4.0).text == "runs: 2 of 4"


@pytest.fixture(scope="module")
def case():
    program = rj.load_program("robojoule/examples/cycle.yaml")
    return program, rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)


def test_plans_trade_offs_and_pages_tell_how_far_they_are_and_come_out_the_same(case):
    heard: list[Progress] = []
    plan = rj.optimize(*case, cycle_time="+10%", progress=heard.append)
    assert {one.work for one in heard} == {"profiles near the plan", "whole speed limits"}
    assert plan.to_dict() == rj.optimize(*case, cycle_time="+10%").to_dict()
    heard.clear()
    curve = rj.pareto(*case, progress=heard.append)
    assert {one.work for one in heard} == {"profiles of motions"}
    done = [one.done for one in heard]
    assert done == sorted(done) and done[-1] == heard[-1].total == 3 and 0 < done[0] < 3
    assert curve.to_dict() == rj.pareto(*case).to_dict()
    heard.clear()
    rj.report(plan, *case, trade_off=curve, progress=heard.append)
    assert {one.work for one in heard} == {"power over the cycle"}
