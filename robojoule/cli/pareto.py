"""`robojoule pareto`: least energy over cycle time, and what one more second of cycle time is worth."""

from __future__ import annotations

import argparse
import csv
import io
from pathlib import Path
from typing import Any

from robojoule.cli._arguments import add_robot, robot_of
from robojoule.errors import InputError

COLUMNS = ("cycle_time_s", "energy_j", "marginal_power_w")
_ROWS_SHOWN = 12


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Program, robot, range and outputs."""
    parser.add_argument("program", type=Path, metavar="PROGRAM", help="operation tree (YAML or JSON)")
    add_robot(parser)
    parser.add_argument(
        "--until",
        choices=("least", "waiting"),
        default="least",
        help="end at the cycle time with the least energy, or where all further time is waited (default: least)",
    )
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write every breakpoint of the curve here")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw energy and marginal power here (.svg)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Simulate where needed, merge the profiles, write what is asked for."""
    from robojoule.documents import write_text
    from robojoule.formats.tree_files import load_tree
    from robojoule.planning.batch import TreeBatch
    from robojoule.planning.pareto import trade_offs

    if arguments.plot is not None and arguments.plot.suffix.lower() != ".svg":
        raise InputError(f"'{arguments.plot.name}' is no vector drawing", key="--plot", allowed="a name with .svg")
    robot = robot_of(arguments)
    tree = load_tree(arguments.program, robot)
    batch = TreeBatch(robot, [tree])
    found = trade_offs(batch)[0]
    curve = found.curve
    last = curve.best if arguments.until == "least" else curve.cycle_times_s.size - 1
    columns = (curve.cycle_times_s, curve.energies_j, curve.marginal_powers_w)
    rows = zip(*(column[: last + 1].tolist() for column in columns), strict=True)
    points = [dict(zip(COLUMNS, row, strict=True)) for row in rows]
    result: dict[str, Any] = {
        "program": tree.name,
        "robot": robot.name,
        "payload_kg": robot.payload.mass_kg,
        "least_cycle_time_s": float(curve.cycle_times_s[0]),
        "energy_fastest_j": float(curve.energies_j[0]),
        "best_cycle_time_s": float(curve.cycle_times_s[curve.best]),
        "best_energy_j": float(curve.energies_j[curve.best]),
        "waiting_cycle_time_s": float(curve.cycle_times_s[-1]),
        "waiting_power_w": float(curve.marginal_powers_w[-1]),
        "largest_gap_percent": 100.0 * found.largest_gap,
        "hull_excess_j": float(curve.hull_excess_j[:last].max(initial=0.0)),
        "simulated_runs": found.runs,
        "moves": len(batch.d_min_s),
        "points": points,
        "csv": str(arguments.csv) if arguments.csv is not None else None,
        "plot": str(arguments.plot) if arguments.plot is not None else None,
    }
    drawing = None
    if arguments.plot is not None:
        from robojoule.plots.pareto_plot import drawing_of

        drawing = drawing_of(result)
    if arguments.csv is not None:
        text = io.StringIO()
        writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(points)
        write_text(arguments.csv, text.getvalue())
    if drawing is not None:
        write_text(arguments.plot, drawing)
    return result


def show(result: dict[str, Any]) -> None:
    """Print the curve at some of its breakpoints."""
    print(f"{result['program']} on {result['robot']}, payload {result['payload_kg']:g} kg")
    print(
        f"fastest cycle {result['least_cycle_time_s']:.4f} s, {result['energy_fastest_j']:.1f} J; "
        f"least energy {result['best_energy_j']:.1f} J at {result['best_cycle_time_s']:.4f} s; from "
        f"{result['waiting_cycle_time_s']:.4f} s on more time is waited at {result['waiting_power_w']:.1f} W"
    )
    print("cycle time [s]  energy [J]  marginal power [W]")
    points = result["points"]
    shown = range(0, len(points), max(len(points) // _ROWS_SHOWN, 1))
    for index in dict.fromkeys((*shown, len(points) - 1)):
        point = points[index]
        print(f"{point['cycle_time_s']:14.4f}  {point['energy_j']:10.1f}  {point['marginal_power_w']:18.1f}")
    print(
        f"{len(points)} breakpoints from {result['simulated_runs']} simulated runs of {result['moves']} moves; "
        f"at most {result['largest_gap_percent']:.3f} % above the proven bound"
    )
    if result["hull_excess_j"] > 0.0:
        print(
            f"a profile is not convex: between breakpoints the curve may be up to {result['hull_excess_j']:.2f} J low"
        )
    for name in ("csv", "plot"):
        if result[name]:
            print(f"written to {result[name]}")
