"""Random motions of a tool that several test modules share."""

import numpy as np

from robojoule.errors import InputError
from robojoule.motion.tool_motions import ToolMove
from robojoule.robots.inverse_kinematics import flange_placement, joints_for_pose
from robojoule.robots.rigid_body import Placement

ROBOTS = ("kuka_kr16_r2010_2", "fanuc_m20_25_18d", "ur_ur10e")
STARTS_DEG = {"ur_ur10e": (0.0, -80.0, 100.0, -110.0, -80.0, 0.0)}


def random_moves(robot, count, seed, *, circles=False, acceleration_m_s2=None):
    """Lines, or circles, that the arm can follow, of a few centimetres to more than half a metre."""
    rng = np.random.default_rng(seed)
    middle = np.radians(STARTS_DEG.get(robot.name, (0.0, -70.0, 90.0, 0.0, 50.0, 0.0)))
    if robot.name.startswith("fanuc"):
        middle = np.radians((0.0, 20.0, 10.0, 0.0, -60.0, 0.0))
    found = []
    while len(found) < count:
        start = middle + rng.normal(0.0, 0.25, 6)
        tool_m = tuple(rng.uniform(-0.1, 0.3, 3))
        flange = flange_placement(robot, start)
        shift = rng.normal(0.0, 1.0, 3)
        shift *= rng.choice([0.03, 0.2, 0.6]) / np.linalg.norm(shift)
        turn = Placement.of((0.0, 0.0, 0.0), tuple(rng.normal(0.0, 0.3, 3))).rotation
        at = flange.at(tool_m)
        rotation = turn @ flange.rotation
        end = Placement(rotation, at + shift - rotation @ np.array(tool_m))
        via = None
        if circles:
            across = np.cross(shift, rng.normal(0.0, 1.0, 3))
            via = tuple(at + 0.5 * shift + rng.uniform(0.1, 0.6) * across / max(np.linalg.norm(across) / 0.2, 1e-3))
        try:
            target = joints_for_pose(robot, end, near_rad=start)[0]
            move = ToolMove(start, target, tool_m, via, acceleration_m_s2)
            move.followed(robot)
        except InputError:
            continue
        found.append(move)
    return found
