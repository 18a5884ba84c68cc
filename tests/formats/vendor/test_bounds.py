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
