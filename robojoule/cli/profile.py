"""`robojoule profile`: the energy profile of one point-to-point motion."""

from __future__ import annotations

import argparse
from typing import Any

from robojoule.cli._arguments import add_angles, add_robot, check_outputs, joints_of, numbers, robot_of, whole_number


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Robot, both ends and the speed limits."""
    add_robot(parser)
    parser.add_argument(
        "--from",
        dest="start",
        required=True,
        type=numbers,
        metavar="DEG",
        help="start joints, comma-separated [deg]",
    )
    parser.add_argument(
        "--to", dest="end", required=True, type=numbers, metavar="DEG", help="end joints, comma-separated [deg]"
    )
    add_angles(parser, "model")
    parser.add_argument(
        "--points", type=whole_number, default=19, metavar="N", help="speed limits from 10 to 100 %% (default: 19)"
    )
    parser.add_argument("--plot", metavar="FILE", help="draw where the energy goes over the duration (.svg)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Simulate the motion over the speed limits, and draw it if asked for."""
    from robojoule.api import energy_profile

    check_outputs(arguments, ["robot"], {"plot": [".svg"]})
    robot = robot_of(arguments)
    start, end = (
        joints_of(joints, robot, option, arguments.angles)
        for joints, option in ((arguments.start, "--from"), (arguments.end, "--to"))
    )
    profile = energy_profile(robot, start, end, points=arguments.points)
    if arguments.plot:
        from robojoule.documents import write_text
        from robojoule.plots.energy import drawing_of

        write_text(arguments.plot, drawing_of(profile))
    return profile.to_dict()


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
    for warning in result["warnings"]:
        print(f"warning: {warning}")
