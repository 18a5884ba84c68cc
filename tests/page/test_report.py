"""The page: what it holds is what the library says, in a real browser too."""

import re
from pathlib import Path

import numpy as np
import pytest
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

import robojoule as rj
from robojoule.errors import InputError
from robojoule.page.report import Report
from robojoule.year import Operation
from tests.browser import browser
from tests.page.held import held

EXAMPLE = Path(rj.__file__).parent / "examples" / "cycle.yaml"


@pytest.fixture(scope="module")
def case() -> tuple[rj.Program, rj.Robot, rj.Plan]:
    program, robot = rj.load_program(EXAMPLE), rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)
    return program, robot, rj.optimize(program, robot, cycle_time="+10%")


@pytest.fixture(scope="module")
def report(case) -> Report:
    program, robot, plan = case
    return rj.report(plan, program, robot)


def integral_j(trace) -> float:
    return float(np.trapezoid(trace.power_w, trace.time_s))


def test_both_cycles_last_as_long_as_the_plan(case, report):
    for trace in (report.given, report.planned):
        assert trace.steps[-1].end_s == pytest.approx(case[2].cycle_time_s, abs=1e-9)
        assert [one.start_s for one in trace.steps[1:]] == [one.end_s for one in trace.steps[:-1]]


def test_power_over_time_holds_the_energy(case, report):
    """Sampled power against the integrals of the simulation, which know no samples."""
    plan = case[2]
    for trace, energy_j in ((report.given, plan.energy_given_j), (report.planned, plan.energy_j)):
        assert integral_j(trace) == pytest.approx(energy_j, rel=0.01)
        assert sum(trace.parts_j.values()) == pytest.approx(energy_j, rel=1e-9)
        mean_j = sum(one.power_w * (one.end_s - one.start_s) for one in trace.steps)
        assert mean_j == pytest.approx(energy_j, rel=1e-9)


def test_the_page_is_one_small_file_that_loads_nothing(report, tmp_path):
    report.save(tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert len(text.encode()) < 500_000
    assert not re.search(r"""(src|href)\s*=|@import|url\(|fetch\(|XMLHttpRequest""", text)
    assert "/*" not in re.sub(r"<script>.*?</script>|<style>.*?</style>", "", text, flags=re.S)


def test_names_cannot_break_the_page(case, tmp_path):
    program, robot, _ = case
    evil = "</script><script>document.title='broken'</script>"
    path = tmp_path / "evil.yaml"
    path.write_text(EXAMPLE.read_text(encoding="utf-8").replace("to part", evil), encoding="utf-8")
    program = rj.load_program(path)
    page = rj.report(rj.optimize(program, robot, cycle_time="+5%"), program, robot).page()
    assert held(page)["movements"][0]["name"] == evil


def test_the_slider_shows_the_figures_of_pareto(case, report, tmp_path):
    program, robot, plan = case
    path = tmp_path / "page.html"
    report.save(path)
    curve = rj.pareto(program, robot).curve
    with browser() as window:
        window.get(path.as_uri())
        text = lambda name: window.find_element(By.ID, name).text.replace("\u2212", "-").replace(",", "")  # noqa: E731
        assert f"{plan.saving_percent:.1f} % less energy" in text("headline")
        slider = "return document.getElementById('cycle-time')"
        least, most = (float(window.execute_script(f"{slider}.{end}")) for end in ("min", "max"))
        for share in (0.0, 0.13, 0.5, 0.86, 1.0):
            wanted = least + share * (most - least)
            move = "const s = document.getElementById('cycle-time'); s.value = arguments[0];"
            window.execute_script(f"{move} s.dispatchEvent(new Event('input'))", wanted)
            seconds = float(window.execute_script(f"{slider}.value"))
            assert float(text("at-time").split()[0]) == pytest.approx(seconds, abs=6e-4)
            seconds = max(seconds, float(curve.cycle_times_s[0]))  # the page rounds to 10 us
            assert float(text("at-energy").split()[0]) == pytest.approx(float(curve.energy_j(seconds)), abs=0.06)
            rows = window.find_elements(By.CSS_SELECTOR, "#moves .duration")
            (durations,) = curve.plan_durations_s(seconds)
            assert [float(row.text.split()[0]) for row in rows] == pytest.approx(durations.tolist(), abs=6e-4)
        charts = window.find_elements(By.CSS_SELECTOR, ".chart canvas")
        assert len(charts) == 2
        assert [entry for entry in window.get_log("browser") if entry["level"] == "SEVERE"] == []
        phone = {"width": 360, "height": 780, "deviceScaleFactor": 2, "mobile": True}
        window.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", phone)
        wide = window.execute_script("dispatchEvent(new Event('resize')); return document.documentElement.scrollWidth")
        assert wide <= 360
        before = float(window.execute_script(f"{slider}.value"))
        window.find_element(By.ID, "cycle-time").send_keys(Keys.ARROW_LEFT, Keys.ARROW_LEFT)
        assert float(text("at-time").split()[0]) < before


@pytest.mark.parametrize("profiles", ["predicted"])
def test_pages_of_other_profiles(case, profiles):
    program, robot, _ = case
    plan = rj.optimize(program, robot, cycle_time="+10%", profiles=profiles)
    found = rj.report(plan, program, robot, trade_off=rj.pareto(program, robot, profiles=profiles)).to_dict()
    assert found["planned"]["parts_j"].keys() == {"motions_j", "standing_j", "process_j"}


def test_a_plan_of_another_program_is_refused(case, tmp_path):
    _, robot, plan = case
    path = tmp_path / "other.yaml"
    path.write_text(EXAMPLE.read_text(encoding="utf-8").replace("to part", "elsewhere"), encoding="utf-8")
    with pytest.raises(InputError, match="not of"):
        rj.report(plan, rj.load_program(path), robot)


def test_a_page_needs_its_suffix(report, tmp_path):
    with pytest.raises(InputError, match="unknown file type"):
        report.save(tmp_path / "page.txt")


def test_a_year_of_more_shifts_saves_more(case, report):
    program, robot, plan = case
    three = rj.report(plan, program, robot, operation=Operation.of(shifts=3)).yearly
    assert three.saved_kwh == pytest.approx(1.5 * report.yearly.saved_kwh)
