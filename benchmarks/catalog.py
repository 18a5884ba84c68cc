"""Every robot of the catalog on one handling motion, as a Markdown table: `python -m benchmarks.catalog`.

The motion: 60 degrees of joint 1, a lean of 20 degrees with the forearm kept level, 30 degrees of each wrist joint,
from beside HOME, at 60 % of the rated payload.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

from robojoule.motion.simulation import MotionPaths
from robojoule.robots import list_robots, load_robot, load_robot_file
from robojoule.robots.robot import Payload

PAYLOAD_SHARE = 0.6
LEANING_DEG = {"KUKA": -20.0, "FANUC": 20.0, "Universal Robots": -20.0}


def row(name: str) -> list[str]:
    """Figures of one robot."""
    file = load_robot_file(name)
    robot = load_robot(name, Payload(PAYLOAD_SHARE * file.rated_payload_kg))
    start = robot.home_rad + np.radians([-30, 0, 0, 0, 0, 0])
    paths = MotionPaths(robot, start, start + np.radians([60, 20, LEANING_DEG[robot.vendor], 30, 30, 30]))
    runs = paths.simulate(np.linspace(0.1, 1.0, 91))
    duration, energy = runs.duration_s[0], runs.energy_j[0]
    best = int(np.argmin(energy))
    return [
        name,
        f"{file.installed_power_w / 1000:.1f}",
        f"{paths.idle_power_start_w[0]:.0f}",
        f"{duration[-1]:.2f}",
        f"{energy[-1] / duration[-1]:.0f}",
        f"{100 * runs.speed_limit[0, best]:.0f}",
        f"{duration[best] / duration[-1]:.2f}",
        f"{100 * (1 - energy[best] / energy[-1]):.1f}",
        f"{runs.peak_torque_ratio.max():.2f}",
    ]


HEADER = [
    "robot",
    "installed power [kW]",
    "idle at HOME [W]",
    "full speed [s]",
    "mean power at full speed [W]",
    "optimum at [%]",
    "slower by",
    "saving [%]",
    "peak torque / limit",
]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    argparse.ArgumentParser(prog="python -m benchmarks.catalog", description=main.__doc__).parse_args(arguments)
    print("| " + " | ".join(HEADER) + " |")
    print("|" + "---|" * len(HEADER))
    for name in list_robots():
        print("| " + " | ".join(row(name)) + " |")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
