"""Operation trees that several test modules plan."""

import numpy as np

from robojoule.formats.tree_files import parse_tree

HOME_DEG = (0.0, -90.0, 90.0, 0.0, 0.0, 0.0)
POINTS_DEG = ((40.0, -70.0, 80.0, 10.0, 30.0, 0.0), (40.0, -50.0, 110.0, 10.0, -20.0, 90.0))


def tree(name="there and back", points=POINTS_DEG, extra=()):
    """HOME, the points, back through them; `extra` are (position, operation) insertions."""
    stops = [*points, *points[-2::-1], HOME_DEG]
    operations = [
        {"type": "move", "name": f"m{i}", "target_rad": np.radians(stop).tolist()} for i, stop in enumerate(stops)
    ]
    for position, operation in sorted(extra, key=lambda item: -item[0]):
        operations.insert(position, operation)
    data = {
        "format": "robojoule-operation-tree",
        "version": 1,
        "name": name,
        "start_rad": np.radians(HOME_DEG).tolist(),
        "operations": operations,
    }
    return parse_tree(data, name)


def busy_tree():
    """With a process step, a wait, a wait at a move, a motion of zero length and a tiny one."""
    return tree(
        "busy",
        extra=(
            (0, {"type": "wait", "name": "part", "duration_s": 0.2}),
            (1, {"type": "process", "name": "weld", "duration_s": 0.4, "power_w": 500.0}),
            (2, {"type": "move", "name": "stay", "target_rad": np.radians(POINTS_DEG[1]).tolist()}),
            (
                2,
                {
                    "type": "move",
                    "name": "stay too",
                    "target_rad": np.radians(POINTS_DEG[1]).tolist(),
                    "wait_after_s": 0.1,
                },
            ),
            (2, {"type": "move", "name": "nudge", "target_rad": np.radians((40.1, *POINTS_DEG[0][1:])).tolist()}),
        ),
    )
