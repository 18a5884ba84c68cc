"""What is promised of plans holds for random programs of every robot, in its vendor's language, as tree and as table.

A fixed budget of seeded programs; `python -m benchmarks.programs` runs ten of each.
"""

import pytest

from benchmarks.programs import LONGER, OWN, SUFFIXES, arms, outcome
from robojoule.robots import list_robots, load_robot

MOVES = 3
URDF_PROGRAMS = 4


@pytest.mark.parametrize("name", list_robots())
def test_programs_of_catalog_robots(tmp_path, name):
    robot = load_robot(name, payload_kg=0.5 * load_robot(name).file.rated_payload_kg)
    number = list_robots().index(name)
    for place, suffix in enumerate((SUFFIXES[robot.vendor], *OWN)):
        longer = LONGER[(number + place) % len(LONGER)]
        assert outcome(robot, suffix, tmp_path, moves=MOVES, seed=100 + number, longer=longer).broken == []


def test_rapid_programs_of_an_arm_given_by_urdf(tmp_path):
    robot, suffixes = list(arms(tmp_path))[-1]
    assert suffixes == (".mod",) and robot.source.startswith(str(tmp_path))
    savings = []
    for seed in range(URDF_PROGRAMS):
        found = outcome(robot, ".mod", tmp_path, moves=MOVES, seed=seed, longer=LONGER[seed % len(LONGER)])
        assert found.broken == []
        savings.append(found.saving_percent)
    assert max(savings) > 1.0


@pytest.mark.parametrize("name", ["kuka_kr16_r2010_2", "fanuc_r2000ic_165f", "ur_ur5e"])
def test_programs_with_zones(tmp_path, name):
    robot = load_robot(name, payload_kg=0.5 * load_robot(name).file.rated_payload_kg)
    found = outcome(robot, SUFFIXES[robot.vendor], tmp_path, moves=MOVES + 1, seed=7, longer=LONGER[1], coarse=0.8)
    assert found.broken == []
