"""What a page holds of long programs: few bytes, and what is left out is told and true."""

import re

import numpy as np
import pytest
from selenium.webdriver.common.by import By

import robojoule as rj
from robojoule.page.packing import DETAILS, ENERGY_J, TIME_S, packed
from robojoule.planning.pareto import TradeOff
from tests.browser import browser
from tests.page.held import held


@pytest.fixture(scope="module")
def long_case(tmp_path_factory) -> tuple[rj.Program, rj.Robot, rj.Plan, TradeOff]:
    """A cycle of 300 motions between random places round a middle one."""
    middle, reach = np.array([0, -90, 90, 0, 45, 0]), np.array([60, 25, 25, 60, 40, 90])
    places = (middle + reach * np.sin(np.random.default_rng(3).normal(0, 2, (299, 6)))).round(2)
    rows = [",0,-90,90,0,45,0", *(f"m{k},{','.join(map(str, place))}" for k, place in enumerate(places))]
    path = tmp_path_factory.mktemp("long") / "long.csv"
    names = ",".join(f"q{k}_deg" for k in range(1, 7))
    path.write_text("\n".join([f"name,{names}", *rows, "home,0,-90,90,0,45,0", ""]), encoding="utf-8")
    program, robot = rj.load_program(path), rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)
    return program, robot, rj.optimize(program, robot, cycle_time="+10%"), rj.pareto(program, robot)


def test_a_page_of_300_motions_is_small_and_says_what_it_leaves_out(long_case, tmp_path):
    program, robot, plan, curve = long_case
    path = tmp_path / "page.html"
    rj.report(plan, program, robot, trade_off=curve).save(path)
    assert path.stat().st_size < 500_000
    (told,) = held(path.read_text(encoding="utf-8"))["shortened"]
    energy, power = map(float, re.findall(r"within ([\d.]+) [JW]", told.replace("the worth of a second ", "")))
    assert energy < 0.05 and power < 30.0
    with browser() as window:
        window.get(path.as_uri())
        assert told in window.find_element(By.ID, "assumptions").text
        least, most = curve.curve.cycle_times_s[0], plan.cycle_time_s
        for wanted in np.linspace(least, 1.2 * most, 9)[1:]:
            found = window.execute_script("return bestPlan(arguments[0])", wanted)
            assert found["energy"] == pytest.approx(float(curve.curve.energy_j(wanted)), abs=energy + 0.02)
            (durations,) = curve.curve.plan_durations_s(wanted)
            assert found["durations"] == pytest.approx(durations.tolist(), abs=5e-4)


@pytest.mark.parametrize("detail", DETAILS[2:])
def test_what_is_left_out_is_told_and_true(long_case, detail):
    program, robot, plan, curve = long_case
    page = packed(rj.report(plan, program, robot, trade_off=curve), detail)
    trade, told = page["trade_off"], " ".join(page["shortened"])
    times, energies = np.cumsum(trade["cycle_times"]) * TIME_S, np.cumsum(trade["energies"]) * ENERGY_J
    at = np.linspace(times[0], times[-1], 500)[1:-1]
    assert np.abs(np.interp(at, times, energies) - curve.curve.energy_j(at)).max() <= detail.energy_j + 0.03
    assert f"{detail.energy_j:g} J" in told and len(trade["lengths"]) - 1 <= 1.5 * detail.steps
    if "ms" in told:
        allowed_s = 1e-3 * float(re.findall(r"within ([\d.]+) ms", told)[0]) + 5e-4
        ends, width = np.cumsum(trade["lengths"]) * TIME_S, trade["width"]
        takers = [int(trade["movements"][k : k + width], 36) for k in range(0, len(trade["movements"]), width)]
        for time in at[::100]:
            used = np.clip(time - ends[:-1], 0.0, np.diff(ends))
            durations = np.array(trade["least_durations"]) * TIME_S + np.bincount(takers, used, 300)
            assert durations.sum() == pytest.approx(time, abs=5e-3)
            assert np.abs(durations - curve.curve.plan_durations_s(time)[0]).max() <= allowed_s
    drawn = sum(one["profile"] is not None for one in page["movements"])
    assert drawn == min(detail.pictures, 300) and ("profiles" in told) == (drawn < 300)
