"""`robojoule identify`: drives and timing from a measured log, or timing alone from a table of runs."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robojoule.cli._arguments import add_robot, check_outputs, number, numbers, robot_of
from robojoule.cli._output import show_written
from robojoule.errors import InputError
from robojoule.inputs import counted

if TYPE_CHECKING:
    from robojoule.calibration.friction import FrictionIdentification
    from robojoule.calibration.identification import Identification
    from robojoule.calibration.log import MeasuredLog
    from robojoule.calibration.timing import TimingIdentification
    from robojoule.robots.robot import Robot


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The log, the robot and what to write."""
    parser.add_argument(
        "log",
        metavar="LOG",
        help="CSV or Parquet with time_s, q1_rad .. (or q1_deg ..), power_w; or a table of runs with move, "
        "speed_limit_percent, duration_s, for the timing alone",
    )
    parser.add_argument("--program", metavar="PROGRAM", help="the program whose moves a table of runs names")
    parser.add_argument(
        "--runs", metavar="FILE", help="a table of runs beside a log: timing comes from it (with --program)"
    )
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
    parser.add_argument(
        "--power-side",
        choices=("mains", "arm"),
        default="mains",
        help="where power was measured: at the mains (default), or on the bus that feeds the arm",
    )
    parser.add_argument("--name", metavar="NAME", help="name of the new robot file (default: the robot's, _identified)")
    parser.add_argument("--out", metavar="FILE", help="write a robot file with the identified drives (JSON or YAML)")
    parser.add_argument("--plot", metavar="FILE", help="draw measured against modelled power (SVG, PNG or PDF)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Read, identify, write what is asked for."""
    from robojoule.api import identify
    from robojoule.calibration.log import check_torque_constants, read_log
    from robojoule.calibration.run_table import is_run_table
    from robojoule.documents import write_files
    from robojoule.plots.identification import PLOT_SUFFIXES, drawing_of

    check_outputs(
        arguments, ["log", "robot", "program", "runs"], {"out": [".json", ".yaml", ".yml"], "plot": PLOT_SUFFIXES}
    )
    if arguments.name is not None and not arguments.name.strip():
        raise InputError("a robot needs a name", key="--name")
    robot = robot_of(arguments)
    if arguments.torque_constants is not None:
        check_torque_constants(arguments.torque_constants, robot)
    if is_run_table(arguments.log):
        return _of_runs(arguments, robot)
    log = read_log(arguments.log, robot, arguments.torque_constants, power_needed=False)
    if not log.has_power:
        return _of_torques(arguments, log, robot)
    result = identify(
        log,
        robot,
        smoothing_s=arguments.smoothing,
        window_s=arguments.window,
        power_side=arguments.power_side,
    )
    if arguments.runs is not None:
        result = replace(result, timing=_timing(arguments, arguments.runs, robot))
    contents = _robot_file(arguments, result)
    if arguments.plot:
        contents[Path(arguments.plot)] = drawing_of(result, Path(arguments.plot).suffix)
    write_files(contents)
    told = result.to_dict()
    told["warnings"] = [*map(str, robot.doubts), *told["warnings"]]
    return {**told, "samples": len(log.time_s), "out": arguments.out, "plot": arguments.plot}


def _of_torques(arguments: argparse.Namespace, log: MeasuredLog, robot: Robot) -> dict[str, Any]:
    """Friction and timing, from a log without power."""
    from robojoule.api import identify_friction
    from robojoule.documents import write_files

    for option in ("plot", "window"):
        if getattr(arguments, option) is not None:
            raise InputError("this needs a log with power", key=f"--{option}", allowed="a column power_w")
    found = identify_friction(log, robot, smoothing_s=arguments.smoothing)
    if arguments.runs is not None:
        found = replace(found, timing=_timing(arguments, arguments.runs, robot))
    write_files(_robot_file(arguments, found))
    return {**found.to_dict(), "samples": len(log.time_s), "out": arguments.out, "plot": None}


def _of_runs(arguments: argparse.Namespace, robot: Robot) -> dict[str, Any]:
    """The timing alone, from a table of runs in the place of the log."""
    from robojoule.documents import write_files

    for option in ("runs", "plot", "torque_constants", "smoothing", "window"):
        if getattr(arguments, option) is not None:
            problem = "this goes with a log, not with a table of runs"
            raise InputError(problem, key=f"--{option.replace('_', '-')}")
    timing = _timing(arguments, arguments.log, robot)
    write_files(_robot_file(arguments, timing))
    head = {"robot": robot.name, "payload_kg": float(robot.payload.mass_kg), "log": timing.source}
    warnings = list(timing.warnings)
    return {**head, "timing": timing.to_dict(), "warnings": warnings, "out": arguments.out, "plot": None}


def _timing(arguments: argparse.Namespace, table: str, robot: Robot) -> TimingIdentification:
    """The timing by a table of runs of the program that is named beside it."""
    from robojoule.api import identify_timing
    from robojoule.formats.program import load_program

    if arguments.program is None:
        raise InputError("a table of runs needs the program whose moves it names", key="--program", allowed="its file")
    return identify_timing(table, load_program(arguments.program), robot)


def _robot_file(
    arguments: argparse.Namespace, result: Identification | FrictionIdentification | TimingIdentification
) -> dict[Path, str | bytes]:
    """The robot file to write, if it is asked for."""
    from robojoule.documents import document_text

    if not arguments.out:
        return {}
    data = result.robot_file(arguments.name).model_dump(mode="json")
    return {Path(arguments.out): document_text(Path(arguments.out).suffix, data)}


def show(result: dict[str, Any]) -> None:
    """Print the parameters and how well the model holds."""
    what = f"{result['samples']} samples of {result['log']}" if "samples" in result else f"runs of {result['log']}"
    print(f"{result['robot']}, payload {result['payload_kg']:g} kg, {what}")
    if result.get("power_side") == "arm":
        print("power measured on the bus of the arm: figures are seen from there, the robot file's from the mains")
    if "parameters" in result:
        _show_drives(result)
    if "joints" in result:
        _show_friction(result["joints"])
    if result["timing"] is not None:
        _show_timing(result["timing"])
    for warning in result["warnings"]:
        print(f"warning: {warning}")
    show_written(result, "out", "plot")


def _show_timing(timing: dict[str, Any]) -> None:
    """Print the controller's rule and its figures."""
    print(
        f"timing from {timing['runs']} runs of {timing['motions']} motions, resolution {timing['resolution_s']:g} s: "
        f"{timing['rule']}"
    )
    print(
        f"durations of motions left out: error {timing['held_out_error_percent']:.2f} % "
        f"(by the entry {timing['nominal_error_percent']:.2f} %)"
    )
    width = max((len(row["name"]) for row in timing["parameters"]), default=0)
    if timing["parameters"]:
        print(f"{'parameter':{width}}  {'value':>10}  {'std. error':>10}  {'before':>10}  unit")
    for row in timing["parameters"]:
        figures = f"{row['value']:10.4g}  {row['standard_error']:10.3g}  {row['before']:10.4g}"
        note = "" if row["identified"] else "  (not told by these runs)"
        print(f"{row['name']:{width}}  {figures}  {row['unit']}{note}")
    print(f"{'other rules':50}  held-out error [%]")
    for rule in timing["rules"][1:4]:
        print(f"{rule['name']:50}  {rule['held_out_error_percent']:.2f}")


def _show_friction(joints: list[dict[str, Any]]) -> None:
    """Print what torques told of each joint."""
    print("joint             Coulomb [Nm]   std. error  viscous [Nm s/rad]   std. error  torque scale     R2")
    for row in joints:
        if row["identified"]:
            errors = row["coulomb_error_nm"], row["viscous_error_nm_s_per_rad"]
            figures = (
                f"{row['coulomb_nm']:12.4g} {errors[0]:12.3g} {row['viscous_nm_s_per_rad']:19.4g} {errors[1]:12.3g}"
            )
        else:
            figures = f"{'(not told)':>12} {'-':>12} {'-':>19} {'-':>12}"
        print(f"{row['joint']:17} {figures}  {row['torque_scale']:12.3f}  {row['r2']:.3f}")


def _show_drives(result: dict[str, Any]) -> None:
    """Print the drives' parameters and how well the energy model holds."""
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
        motions = f"{counted(score['motions'], 'motion'):>12}"
        part = f"{title:18} {motions} {score['duration_s']:7.1f} s  R2 {score['r2']:.4f}  "
        rmse = f"RMSE {score['rmse_w']:.1f} W ({score['rmse_percent']:.2f} %)  "
        print(f"{part}{rmse}energy {score['energy_error_percent']:+.2f} %")
