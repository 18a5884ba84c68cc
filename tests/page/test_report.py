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
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.year import Operation
from tests.browser import browser
from tests.calibration.machines import closed_cycle, joint_controller, observed
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


def test_a_page_of_predicted_profiles(case):
    program, robot, _ = case
    plan = rj.optimize(program, robot, cycle_time="+10%", profiles="predicted")
    found = rj.report(plan, program, robot, trade_off=rj.pareto(program, robot, profiles="predicted")).to_dict()
    assert found["planned"]["parts_j"].keys() == {"motions_j", "standing_j", "process_j"}


def test_a_page_of_measured_runs():
    """Powers are means of the motions; what the page holds adds up to the energies of the plan on the runs."""
    paths, points = closed_cycle(seed=9, moves=4)
    program = rj.Program(tree_from_configurations("cell", points))
    machine = joint_controller(paths.robot, exponent=1.0)
    runs = observed(paths, machine, (1.0, 0.6, 0.3))
    plan = rj.optimize(program, paths.robot, cycle_time="+30%", runs=runs)
    curve = rj.pareto(program, paths.robot, runs=runs)
    made = rj.report(plan, program, paths.robot, trade_off=curve)
    assert plan.profiles == "measured"
    assert sum(made.planned.parts_j.values()) == pytest.approx(plan.energy_j, rel=1e-9)
    assert integral_j(made.planned) == pytest.approx(plan.energy_j, rel=0.01)
    shown = held(made.page())
    assert shown["plan"]["profiles"] == "measured" and len(shown["movements"]) == 4
    assert shown["plan"]["outlook"]["saving_low_percent"] < plan.saving_percent


def test_more_energy_is_called_more_and_what_the_program_sets_is_carried(tmp_path):
    """A faster cycle takes more energy; the payloads are those that the program sets."""
    slow = EXAMPLE.read_text(encoding="utf-8").replace("type: move,", "type: move, speed_limit_percent: 40,")
    payload = "  - {type: payload, name: gripper, mass_kg: 4, com_m: [0, 0, 0.1]}\n"
    head, end, tail = slow.partition("every name once\n")
    (tmp_path / "faster.yaml").write_text(head + end + payload + tail, encoding="utf-8")
    program, robot = rj.load_program(tmp_path / "faster.yaml"), rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)
    given_s = rj.simulate(program, robot).cycle_time_s
    plan = rj.optimize(program, robot, cycle_time=0.75 * given_s, allow_faster=True)
    assert plan.saving_percent < -0.1
    rj.report(plan, program, robot).save(tmp_path / "page.html")
    with browser() as window:
        window.get((tmp_path / "page.html").as_uri())
        said = f"{-plan.saving_percent:.1f} % more energy"
        assert window.title == f"{plan.program.name}: {said}"
        assert said in window.find_element(By.ID, "headline").text
        assert "payload 4 kg as the program sets it," in window.find_element(By.ID, "what").text
        tiles = window.find_element(By.ID, "tiles").text
        assert "more a year" in tiles and "saved a year" not in tiles and "\u2212" not in tiles


def test_a_page_that_is_too_large_all_the_same_says_so(report, monkeypatch):
    monkeypatch.setattr("robojoule.page.report.MOST_BYTES", 60_000)  # less than uPlot and the page itself
    assert held(report.page())["shortened"][-1] == "even so the page is larger than 60 kB"


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
