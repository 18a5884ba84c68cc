"""Trees with coarse zones, speed groups and changes of payload that several test modules plan."""

import numpy as np

from robojoule.formats.program import Program
from robojoule.formats.tree_files import parse_tree
from tests.planning.trees import HOME_DEG

WAY_DEG = ((30, -80, 85, 0, 15, 0), (55, -60, 80, 20, 30, 30), (80, -75, 95, 20, 10, 60), (60, -40, 110, -10, 20, 0))


def move(name, target_deg, **keys):
    return {"type": "move", "name": name, "target_rad": np.radians(target_deg).tolist(), **keys}


def program(operations, name="blended"):
    data = {
        "format": "robojoule-operation-tree",
        "version": 1,
        "name": name,
        "start_rad": np.radians(HOME_DEG).tolist(),
        "operations": operations,
    }
    return Program(parse_tree(data, name))


def there_and_back(zone, **keys):
    """HOME, two points on the way to a place, and back through two others."""
    a, b, c, d = WAY_DEG
    return program(
        [
            move("a", a, zone=zone, **keys),
            move("b", b, zone=zone, **keys),
            move("place", c, wait_after_s=0.3, **keys),
            move("d", d, zone=zone, **keys),
            move("home", HOME_DEG, **keys),
        ]
    )


def carrying():
    """Empty to a place, with a part to another one, and empty back."""
    a, b, c, d = WAY_DEG
    return program(
        [
            move("a", a, zone={"radius_m": 0.1}),
            move("pick", b),
            {"type": "payload", "name": "grip", "mass_kg": 14.0, "com_m": [0.0, 0.05, 0.15]},
            {"type": "wait", "name": "gripped", "duration_s": 0.2},
            move("c", c, zone={"path_share": 0.3}),
            move("place", d),
            {"type": "payload", "name": "release", "mass_kg": 2.0, "inertia_kg_m2": [0.01, 0.01, 0.01]},
            move("home", HOME_DEG),
        ],
        "carrying",
    )


def loop(zone="fine"):
    """The same two lines twice, from different starts."""
    a, b, c, _ = WAY_DEG
    return program(
        [
            move("first", a, speed_group="line 1", zone=zone),
            move("second", b, speed_group="line 2"),
            move("first again", a, speed_group="line 1", zone=zone),
            move("second again", c, speed_group="line 2"),
            move("home", HOME_DEG),
        ],
        "loop",
    )
