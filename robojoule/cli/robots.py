"""`robojoule robots`: the catalog, checks of robots from files, and drive files by the scaling laws."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from robojoule.cli._arguments import number
from robojoule.errors import InputError, each_of
from robojoule.inputs import as_number, as_path

GROUPS = ("kinematics", "limits", "effort", "inertia", "capsules", "drives")
REFUSED = 2
LEAST_RATED_KG, MOST_RATED_KG = 0.01, 1e4  # the laws are told from arms of 3 to 500 kg


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The catalog, or what to do with a file."""
    actions = parser.add_subparsers(
        dest="action", metavar="ACTION", help="check or scale; without it the catalog is listed"
    )
    check = actions.add_parser("check", help="everything wrong or implausible in a robot file or URDF")
    check.add_argument("file", metavar="FILE", help="robot file, URDF or catalog name")
    check.add_argument("--drives", metavar="FILE", help="drive file of a URDF (default: the one beside it)")
    scale = actions.add_parser("scale", help="write a drive file for a URDF, scaled from known drives")
    scale.add_argument("file", metavar="URDF", help="the arm")
    scale.add_argument("--rated-payload", required=True, type=number, metavar="KG", help="rated payload [kg]")
    scale.add_argument("--collaborative", action="store_true", help="harmonic drives, as in collaborative arms")
    scale.add_argument("--tool", metavar="LINK", help="link that carries the tool (default: found by name or place)")
    scale.add_argument(
        "--freeze",
        action="append",
        default=[],
        metavar="JOINT=POSITION",
        help="a joint that stands still [rad or m]; may be given several times",
    )
    scale.add_argument("--out", type=Path, metavar="FILE", help="where to (default: the URDF's name with .drives.yaml)")
    for one in (check, scale):
        one.add_argument("--json", action="store_true", default=argparse.SUPPRESS, help="print one JSON object instead")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """List, check or scale."""
    return {None: _list, "check": _check, "scale": _scale}[arguments.action](arguments)


def exit_code(result: dict[str, Any]) -> int:
    """2 where a check found errors: such a file is refused everywhere."""
    return REFUSED if result.get("errors") else 0


def _list(arguments: argparse.Namespace) -> dict[str, Any]:
    from robojoule.robots import list_robots, load_robot_file

    rows = []
    for name in list_robots():
        file = load_robot_file(name)
        rows.append(
            {
                "name": name,
                "vendor": file.vendor,
                "joints": len(file.moving_joints),
                "rated_payload_kg": file.rated_payload_kg,
                "reach_m": round(file.reach_m, 3),
                "mass_kg": round(file.total_mass_kg, 1),
                "provenance": {group: file.provenance[group].kind for group in GROUPS if group in file.provenance},
                "notes": {group: file.provenance[group].note for group in GROUPS if group in file.provenance},
                "lumped_links": dict(file.lumped_links),
                "drives": file.drives.provenance,
                "caveats": file.caveats,
                "source": file.source,
                "license": file.license,
            }
        )
    return {"robots": rows}


def _check(arguments: argparse.Namespace) -> dict[str, Any]:
    from robojoule.robots import load_robot

    try:
        robot = load_robot(arguments.file, drives=arguments.drives)
        doubts = [{"problem": doubt.problem, "key": doubt.key} for doubt in robot.doubts]
    except InputError as error:
        errors = [{"file": e.file, "key": e.key, "problem": e.problem, "allowed": e.allowed} for e in each_of(error)]
        return {"file": str(arguments.file), "robot": None, "errors": errors, "doubts": []}
    return {"file": str(arguments.file), "robot": robot.name, "errors": [], "doubts": doubts}


def _scale(arguments: argparse.Namespace) -> dict[str, Any]:
    from robojoule.documents import check_output, write_document
    from robojoule.robots.urdf import DRIVE_FILE_SUFFIXES
    from robojoule.robots.urdf_scaling import scaled_drive_file

    path = as_path(arguments.file, "file")
    if path.suffix.lower() != ".urdf":
        raise InputError("only a URDF needs a drive file", file=path, allowed="a file with the suffix .urdf")
    as_number(arguments.rated_payload, "--rated-payload", least=LEAST_RATED_KG, most=MOST_RATED_KG, unit="kg")
    out = path.with_suffix(DRIVE_FILE_SUFFIXES[0]) if arguments.out is None else arguments.out
    if not str(out).lower().endswith(DRIVE_FILE_SUFFIXES):
        raise InputError("unknown file type", file=out, key="--out", allowed=", ".join(DRIVE_FILE_SUFFIXES))
    check_output(out, "--out")
    if out.exists():
        raise InputError("the file exists already", file=out, allowed="a new file, named by --out")
    data, lacking = scaled_drive_file(
        path,
        arguments.rated_payload,
        cobot=arguments.collaborative,
        tool=arguments.tool,
        freeze=dict(_position(text) for text in arguments.freeze),
    )
    write_document(out, data)
    return {
        "file": str(path),
        "out": str(out),
        "tool": data["tool"]["parent"],
        "joints": list(data["drives"]["joints"]),
        "provenance": data["provenance"],
        "frozen": data.get("freeze", {}),
        "lacking": [{"key": e.key, "problem": e.problem, "allowed": e.allowed} for e in lacking],
    }


def _position(text: str) -> tuple[str, float]:
    name, equals, value = text.rpartition("=")
    if not equals:
        raise InputError(f"'{text}' names no position", key="--freeze", allowed="JOINT=POSITION")
    try:
        return name, number(value)
    except argparse.ArgumentTypeError as error:
        raise InputError(str(error), key="--freeze", allowed="JOINT=POSITION") from None


def show(result: dict[str, Any]) -> None:
    """Print one line per robot or finding."""
    if "robots" in result:
        _show_catalog(result["robots"])
    elif "out" in result:
        _show_drive_file(result)
    else:
        _show_findings(result)


def _show_catalog(rows: list[dict[str, Any]]) -> None:
    width = max((len(row["name"]) for row in rows), default=4)
    print(f"{'name':{width}}  {'vendor':16}  payload [kg]  reach [m]  mass [kg]  inertia    effort     drives")
    for row in rows:
        kinds = row["provenance"]
        print(
            f"{row['name']:{width}}  {row['vendor']:16}  {row['rated_payload_kg']:12g}  {row['reach_m']:9.2f}"
            f"  {row['mass_kg']:9.0f}  " + "  ".join(f"{kinds.get(g, '-'):9}" for g in ("inertia", "effort", "drives"))
        )
    print("reach: along the chain from joint 2 to the tool frame; mass: of all links with published figures")
    print("composed: from published siblings; fitted: on published totals; scaled: by law (notes with --json)")


def _show_findings(result: dict[str, Any]) -> None:
    for error in result["errors"]:
        print(f"error: {InputError(error['problem'], key=error['key'], allowed=error['allowed'])}")
    for doubt in result["doubts"]:
        print(f"doubt: {InputError(doubt['problem'], key=doubt['key'])}")
    if not result["errors"]:
        print(f"{result['file']} can be used" + ("" if not result["doubts"] else ", but look at the doubts"))


def _show_drive_file(result: dict[str, Any]) -> None:
    print(f"arm of {len(result['joints'])} joints, from {result['joints'][0]} to the tool on '{result['tool']}'")
    for group, origin in result["provenance"].items():
        print(f"{group}: {origin['kind']}, {origin['note']}")
    for joint, position in result["frozen"].items():
        print(f"'{joint}' stands still at {position:g}")
    for error in result["lacking"]:
        print(f"still lacking: {InputError(error['problem'], key=error['key'], allowed=error['allowed'])}")
    print(f"written to {result['out']}")
