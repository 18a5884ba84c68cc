"""What the benchmarks share, and that the page on performance says what was measured."""

import json
import sys

import pytest

from benchmarks import cells, commands, table
from benchmarks.measure import interleaved, ratio, rounded, run
from benchmarks.scale import motions_per_s
from tests.planning.cells.cases import two_robots


def test_the_page_shows_the_recorded_results():
    results = json.loads(table.RESULTS.read_text(encoding="utf-8"))
    assert table.BEGIN + table.markdown(results) + table.END in table.PAGE.read_text(encoding="utf-8")


def test_every_measured_figure_has_its_place_in_the_table():
    """A ratio that the table does not know would be measured for nothing."""
    results = json.loads(table.RESULTS.read_text(encoding="utf-8"))
    text = table.markdown(results)
    parts = {name: part for name, part in results.items() if name not in ("machine", "versions")}
    shown = {(section, figure) for section, figure, *_ in table.ROWS}
    for section, part in parts.items():
        for name, value in part.items():
            beside = any(f"{{{name}}}" in row[4] for row in table.ROWS if row[0] == section)
            assert (section, name) in shown or beside or name in ("curve", "floor_nodes"), f"{section}.{name}"
            if (section, name) in shown:
                assert f"| {value:.4g} |" in text


def test_profile_is_compared_with_the_packages_that_it_loads():
    """All of them, and none that it does without: that would flatter it."""
    show = "import sys; print(*{name.partition('.')[0] for name in sys.modules} - set(sys.stdlib_module_names))"
    profile = f"from robojoule.cli import main\nmain({commands.PROFILE.split()!r})"
    reference, used = (
        set(run([sys.executable, "-c", f"{code}\n{show}"]).output.splitlines()[-1].split())
        for code in (commands.PACKAGES, profile)
    )
    assert reference <= used
    others = {"coal", "highspy", "matplotlib", "pinocchio", "pyomo", "ruckig", "scipy", "threadpoolctl"}
    assert not used & others


def test_rounds_are_interleaved_after_one_that_does_not_count():
    order, now = [], iter(range(100))

    def work(name):
        return lambda: order.append(name)

    seconds = interleaved(2, lambda: next(now), a=work("a"), b=work("b"))
    assert order == ["a", "b"] * 3
    assert seconds == {"a": [1, 1], "b": [1, 1]}


def test_a_ratio_is_the_median_of_the_rounds_quotients():
    assert ratio({"a": [2.0, 30.0, 8.0], "b": [1.0, 1.0, 2.0]}, "a", "b") == 4.0


def test_figures_are_rounded_to_significant_digits():
    assert rounded({"large": 123456.0, "small": 0.000123456}) == {"large": 123500.0, "small": 0.0001235}


def test_the_memory_of_a_command_counts_its_children():
    child = "import time; held = bytearray(150 * 2**20); time.sleep(1.5)"
    parent = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}]); print('done')"
    done = run([sys.executable, "-c", parent], watch=True)
    assert done.output == "done\n" and done.seconds > 1.5
    assert 150.0 < done.peak_mib < 300.0


def test_a_command_that_fails_is_told_with_its_output():
    with pytest.raises(RuntimeError, match=r"ended with 3:\nwhy"):
        run([sys.executable, "-c", "print('why'); raise SystemExit(3)"])


def test_a_rate_counts_from_the_first_shard_of_every_worker():
    ends = [9.0, 9.5, 11.0, 11.5, 13.5]
    log = "\n".join(f"| shard {k}: {k + 1} of 5 after {end} s" for k, end in enumerate(ends))
    assert motions_per_s(log, 1000, 2) == pytest.approx(3 * 1000 / 4.0)


def test_savings_of_cells_are_against_full_speed():
    """More power modes never cost, speeds save on top of them; the plan itself is what the savings say."""
    cell = two_robots()
    found = cells.savings(cell, 30.0)
    assert found["full_speed_brakes_j"] <= found["full_speed_j"]
    assert 0.0 <= found["modes_percent"] <= found["speeds_2_modes_percent"]
    assert found["speeds_1_modes_percent"] <= found["speeds_2_modes_percent"]
    planned = cells.result(cell, 30.0, 1, 0)
    assert planned["feasible"] and planned["status"] == "optimal"
    share = 100.0 * (1.0 - planned["energy_j"] / found["full_speed_j"])
    assert share == pytest.approx(found["speeds_2_modes_percent"], abs=0.02)
