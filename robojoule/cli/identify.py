"""`robojoule identify`: drive parameters from a measured log."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from robojoule.cli._arguments import add_robot, check_outputs, number, numbers, robot_of
from robojoule.cli._output import show_written
from robojoule.errors import InputError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The log, the robot and what to write."""
    parser.add_argument("log", metavar="LOG", help="CSV or Parquet with time_s, q1_rad .. (or q1_deg ..), power_w")
    add_robot(parser)
    parser.add_argument(
        "--torque-constants",
        type=numbers,
        metavar="KT",
        help="torque constants, comma-separated, for q1_current_a .. [Nm/A]",
    )
    parser.add_argument(
        "--smoothing", type=number, metavar="S", help="length for differentiation [s] (default: chosen by noise)"
    )
    parser.add_argument("--window", type=number, metavar="S", help="length for averaging power [s] (default: 0.1)")
    parser.add_argument("--name", metavar="NAME", help="name of the new robot file (default: the robot's, _identified)")
    parser.add_argument("--out", metavar="FILE", help="write a robot file with the identified drives (JSON or YAML)")
    parser.add_argument("--plot", metavar="FILE", help="draw measured against modelled power (SVG, PNG or PDF)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Read, identify, write what is asked for."""
    from robojoule.api import identify
    from robojoule.calibration.log import read_log
    from robojoule.documents import document_text, write_files
    from robojoule.plots.identification import PLOT_SUFFIXES, drawing_of

    check_outputs(arguments, ["log", "robot"], {"out": [".json", ".yaml", ".yml"], "plot": PLOT_SUFFIXES})
    if arguments.name is not None and not arguments.name.strip():
        raise InputError("a robot needs a name", key="--name")
    robot = robot_of(arguments)
    log = read_log(arguments.log, robot, arguments.torque_constants)
    result = identify(log, robot, smoothing_s=arguments.smoothing, window_s=arguments.window)
    contents: dict[Path, str | bytes] = {}
    if arguments.out:
        data = result.robot_file(arguments.name).model_dump(mode="json")
        contents[Path(arguments.out)] = document_text(Path(arguments.out).suffix, data)
    if arguments.plot:
        contents[Path(arguments.plot)] = drawing_of(result, Path(arguments.plot).suffix)
    write_files(contents)
    return {**result.to_dict(), "samples": len(log.time_s), "out": arguments.out, "plot": arguments.plot}


def show(result: dict[str, Any]) -> None:
    """Print the parameters and how well the model holds."""
    print(f"{result['robot']}, payload {result['payload_kg']:g} kg, {result['samples']} samples of {result['log']}")
    width = max(len(row["name"]) for row in result["parameters"])
    print(f"{'parameter':{width}}  {'value':>10}  {'std. error':>10}  {'inertia +-':>10}  {'catalog':>10}  unit")
    for row in result["parameters"]:
        if row["identified"]:
            error = f"{row['standard_error']:10.3g}  {row['inertia_error']:10.3g}"
            note = "  (at its physical bound)" if row["at_bound"] else ""
        elif row["confounded_with"]:
            error, note = f"{'-':>10}  {'-':>10}", f"  kept: cannot be told from {', '.join(row['confounded_with'])}"
        else:
            error, note = f"{'-':>10}  {'-':>10}", "  kept: too little in the log depends on it"
        print(
            f"{row['name']:{width}}  {row['value']:10.4g}  {error}  {row['catalog_value']:10.4g}  {row['unit']}{note}"
        )
    for key, title in (("training", "fitted"), ("held_out", "held out"), ("held_out_catalog", "held out, catalog")):
        score = result[key]
        part = f"{title:18} {score['motions']:4d} motions {score['duration_s']:7.1f} s  R2 {score['r2']:.4f}  "
        rmse = f"RMSE {score['rmse_w']:.1f} W ({score['rmse_percent']:.2f} %)  "
        print(f"{part}{rmse}energy {score['energy_error_percent']:+.2f} %")
    for warning in result["warnings"]:
        print(f"warning: {warning}")
    show_written(result, "out", "plot")
