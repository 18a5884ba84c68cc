"""`robojoule profile`: the energy profile of one point-to-point motion."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from robojoule.cli._arguments import add_robot, joints_of, robot_of
from robojoule.errors import InputError

if TYPE_CHECKING:
    from robojoule.arrays import Array


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Robot, both ends and the speed limits."""
    add_robot(parser)
    parser.add_argument(
        "--from", dest="start", required=True, metavar="DEG", help="start joints, comma-separated [deg]"
    )
    parser.add_argument("--to", dest="end", required=True, metavar="DEG", help="end joints, comma-separated [deg]")
    parser.add_argument(
        "--points", type=int, default=19, metavar="N", help="speed limits from 10 to 100 %% (default: 19)"
    )
    parser.add_argument("--plot", metavar="FILE", help="draw where the energy goes over the duration (.svg)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Simulate the motion over the speed limits."""
    import numpy as np

    from robojoule.motion.simulation import MotionPaths
    from robojoule.plots.energy_plot import ENERGY_PARTS

    if not 2 <= arguments.points <= 1000:
        raise InputError(f"{arguments.points} is not a number of points", key="--points", allowed="2 to 1000")
    robot = robot_of(arguments)
    start, end = joints_of(arguments.start, robot, "--from"), joints_of(arguments.end, robot, "--to")
    if arguments.plot and not arguments.plot.endswith(".svg"):
        raise InputError(f"'{arguments.plot}' is no image file", key="--plot", allowed=".svg")
    if np.array_equal(start, end):
        raise InputError("start and end are the same: there is no motion", key="--to")
    paths = MotionPaths(robot, start, end)
    runs = paths.simulate(np.linspace(0.1, 1.0, arguments.points))
    duration, energy, limit = runs.duration_s[0], runs.energy_j[0], runs.speed_limit[0]
    distinct = np.append(True, np.abs(np.diff(duration)) > 1e-9)  # faster limits may give the same run
    best = int(np.argmin(energy))
    parts = {part: getattr(runs, part)[0, distinct] for part in ENERGY_PARTS}
    if arguments.plot:
        _plot(arguments.plot, {"duration_s": duration[distinct], "energy_j": energy[distinct], **parts})
    return {
        "robot": robot.name,
        "payload_kg": robot.payload.mass_kg,
        "speed_limit_percent": (100.0 * limit[distinct]).round(6).tolist(),
        "duration_s": duration[distinct].tolist(),
        "energy_j": energy[distinct].tolist(),
        "parts_j": {part: values.tolist() for part, values in parts.items()},
        "optimal_speed_limit_percent": round(100.0 * float(limit[best]), 6),
        "optimal_duration_s": float(duration[best]),
        "energy_saving_j": float(energy[-1] - energy[best]),
        "peak_torque_ratio": float(runs.peak_torque_ratio.max()),
        "idle_power_start_w": float(paths.idle_power_start_w[0]),
        "idle_power_end_w": float(paths.idle_power_end_w[0]),
    }


def _plot(path: str, rows: dict[str, Array]) -> None:
    from robojoule.documents import write_text
    from robojoule.plots.energy_plot import stacked_over_duration
    from robojoule.plots.style import Style, svg_text

    style = Style()
    rising = {name: values[::-1] for name, values in rows.items()}
    with style.applied():
        write_text(path, svg_text(stacked_over_duration(rising, style)))


def show(result: dict[str, Any]) -> None:
    """Print the profile as a table."""
    print(f"{result['robot']}, payload {result['payload_kg']:g} kg")
    print("speed limit [%]  duration [s]  energy [J]")
    rows = zip(result["speed_limit_percent"], result["duration_s"], result["energy_j"], strict=True)
    for limit, duration, energy in rows:
        mark = "  optimum" if limit == result["optimal_speed_limit_percent"] else ""
        print(f"{limit:15.1f}  {duration:12.4f}  {energy:10.1f}{mark}")
    print(f"saving at the optimum: {result['energy_saving_j']:.1f} J against full speed")
    print(
        f"idle power: {result['idle_power_start_w']:.1f} W at the start, {result['idle_power_end_w']:.1f} W at the end"
    )
    if result["peak_torque_ratio"] > 1.0:
        print(
            f"warning: a joint torque reaches {100.0 * result['peak_torque_ratio']:.1f} % of its effort limit: "
            "lighten the payload or fold the arm"
        )
