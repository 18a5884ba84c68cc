"""Numbers that no program means: one sentence in every language, whatever they name."""

import re

import numpy as np
import pytest

import robojoule as rj
from robojoule.errors import InputError
from robojoule.formats.conversion import converted
from robojoule.programs.operation_tree import tree_from_configurations

ROBOTS = {".src": "kuka_kr16_r2010_2", ".mod": "kuka_kr16_r2010_2", ".ls": "fanuc_m20_25_18d", ".script": "ur_ur10e"}
ENDLESS = {"infinite": "1E400", "large": "1E300", "long": "9" * 5001}
NUMBER = re.compile(r"(?<![\w.])\d+(\.\d+)?(?![\w.])")


@pytest.mark.parametrize("number", ENDLESS.values(), ids=ENDLESS.keys())
@pytest.mark.parametrize("suffix", ROBOTS)
def test_every_number_of_a_program_may_be_beyond_all_bounds(tmp_path, suffix, number):
    """One at a time, at up to forty places: the program is refused, or what it says there does not matter."""
    robot = rj.load_robot(ROBOTS[suffix])
    home = np.array(robot.home_rad)
    tree = tree_from_configurations("there", [home, home + 0.3, home], robot.name)
    path = tmp_path / f"there{suffix}"
    converted(rj.Program(tree), path, robot)
    for file in sorted(tmp_path.iterdir()):
        text = file.read_text(encoding="utf-8")
        places = list(NUMBER.finditer(text))
        for place in places[:: max(len(places) // 40, 1)]:
            file.write_text(text[: place.start()] + number + text[place.end() :], encoding="utf-8")
            try:
                rj.simulate(rj.load_program(path), robot)
            except InputError as error:
                assert len(str(error)) < 300 and str(error).isprintable()
        file.write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    "suffix, wait",
    [
        (".src", "WAIT SEC 90000"),
        (".mod", "WaitTime 90000;"),
        (".ls", "  : WAIT 90000.00(sec) ;"),
        (".script", "sleep(90000)"),
    ],
)
def test_a_wait_of_more_than_a_day_is_refused_with_its_line(tmp_path, suffix, wait):
    robot = rj.load_robot(ROBOTS[suffix])
    home = np.array(robot.home_rad)
    tree = tree_from_configurations("there", [home, home + 0.3, home], robot.name)
    move = tree.moves()[0].name
    path = tmp_path / f"there{suffix}"
    converted(rj.Program(tree.with_plan({}, waits_after_s={move: 0.5})), path, robot)
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    (place,) = [i for i, line in enumerate(lines) if re.search("wait|sleep", line, re.IGNORECASE)]
    number = re.match(r"\s*\d+", lines[place])
    lines[place] = (f"{number[0]}{wait}" if number and suffix == ".ls" else wait) + "\n"
    path.write_text("".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match=rf"line {place + 1}: .*less than or equal to 86400"):
        rj.simulate(rj.load_program(path), robot)
