"""`robojoule robots`: the catalog."""

from __future__ import annotations

import argparse
from typing import Any

GROUPS = ("kinematics", "limits", "effort", "inertia", "capsules", "drives")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """No arguments of its own."""


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """List the catalog."""
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


def show(result: dict[str, Any]) -> None:
    """Print one line per robot."""
    rows = result["robots"]
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
