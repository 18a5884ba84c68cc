"""`robojoule optimize`: the plan with the least energy for a cycle time, written back into the program."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

from robojoule.cli._arguments import add_robot, robot_of
from robojoule.errors import InputError

RELATIVE_GAP = 8e-5  # proven gap of the plan at which no more runs are simulated


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Program, robot, cycle time and output."""
    parser.add_argument("program", type=Path, metavar="PROGRAM", help="operation tree (YAML or JSON)")
    add_robot(parser)
    parser.add_argument(
        "--cycle-time", required=True, metavar="T", help="seconds (7.5), or longer than the fastest cycle by (+10%%)"
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the program with speed limits and waits here")


def cycle_time_s(text: str, least_s: float) -> float:
    """Cycle time from "7.5" (seconds) or "+10%" (above the fastest cycle).

    Raises:
        InputError: Neither of both, or not positive.
    """
    relative = text.startswith("+") and text.endswith("%")
    try:
        value = float(text[1:-1] if relative else text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value < 0 or (not relative and value == 0):
        raise InputError(f"'{text}' is no cycle time", key="--cycle-time", allowed="seconds (7.5) or a share (+10%)")
    return least_s * (1.0 + value / 100.0) if relative else value


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Profiles -> graph -> solve -> write back -> verify."""
    import numpy as np

    from robojoule.formats.tree_files import load_tree, save_tree
    from robojoule.planning.batch import TreeBatch
    from robojoule.planning.rule import rule_plan
    from robojoule.planning.source_plans import plan_on_source
    from robojoule.planning.writeback import simulate_trees, speed_limits_of_plans, write_plan
    from robojoule.profile.adaptive import AdaptiveProfiles

    robot = robot_of(arguments)
    tree = load_tree(arguments.program, robot)
    batch = TreeBatch(robot, [tree])
    graph, least = batch.graphs[0], float(batch.least_cycles_s[0])
    cycle = cycle_time_s(arguments.cycle_time, least)
    plans = [rule_plan(graph, batch.d_min_s, cycle)]
    source = AdaptiveProfiles(batch.paths, batch.slowest_speed_limit)
    plans += plan_on_source(source, batch, np.array([[cycle]]), relative_gap=RELATIVE_GAP).plans[0]
    limits = speed_limits_of_plans(batch, [plans])
    durations = batch.paths.durations(limits)
    written = [write_plan(tree, graph, plan, limits[:, k], durations[:, k]) for k, plan in enumerate(plans)]
    full_speed, optimized = simulate_trees(batch, [written])[0]
    if arguments.out is not None:
        save_tree(written[1], arguments.out)
    bound = min(plans[1].bound_j, optimized.energy_j)  # a plan that exists is above the bound but for rounding
    return {
        "program": tree.name,
        "robot": robot.name,
        "payload_kg": robot.payload.mass_kg,
        "cycle_time_s": optimized.cycle_time_s,
        "least_cycle_time_s": least,
        "energy_j": optimized.energy_j,
        "energy_unoptimized_j": full_speed.energy_j,
        "saving_percent": 100.0 * (1.0 - optimized.energy_j / full_speed.energy_j),
        "bound_j": bound,
        "gap_to_optimum_percent": 100.0 * (optimized.energy_j / bound - 1.0),
        "moves": [
            {
                "name": vertex.moves[-1],
                "speed_limit_percent": 100.0 * float(optimized.speed_limits[v]),
                "duration_s": float(optimized.durations_s[v]),
                "wait_before_s": float(optimized.prior_waits_s[v]),
                "wait_after_s": float(optimized.post_waits_s[v]),
            }
            for v, vertex in enumerate(graph.vertices)
        ],
        "out": str(arguments.out) if arguments.out is not None else None,
    }


def show(result: dict[str, Any]) -> None:
    """Print the plan."""
    print(f"{result['program']} on {result['robot']}, payload {result['payload_kg']:g} kg")
    print(f"cycle time {result['cycle_time_s']:.4f} s (fastest {result['least_cycle_time_s']:.4f} s)")
    print(
        f"energy {result['energy_j']:.1f} J a cycle instead of {result['energy_unoptimized_j']:.1f} J at full speed: "
        f"{result['saving_percent']:.2f} % less, at most {result['gap_to_optimum_percent']:.4f} % above the optimum"
    )
    width = max(len(move["name"]) for move in result["moves"])
    print(f"{'move':{width}}  speed limit [%]  duration [s]  wait before [s]  wait after [s]")
    for move in result["moves"]:
        print(
            f"{move['name']:{width}}  {move['speed_limit_percent']:15.2f}  {move['duration_s']:12.4f}  "
            f"{move['wait_before_s']:15.4f}  {move['wait_after_s']:14.4f}"
        )
    if result["out"]:
        print(f"written to {result['out']}")
