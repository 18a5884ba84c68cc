"""The catalog of robots: one file an arm, published figures with source and licence."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from robojoule.documents import load
from robojoule.errors import InputError

if TYPE_CHECKING:
    from robojoule.robots.model_file import RobotFile
    from robojoule.robots.robot import Payload, Robot


def catalog_path(name: str) -> Path:
    """File of a catalog entry, whether it exists or not."""
    return _catalog() / f"{name}.json"


def _catalog() -> Path:
    return Path(str(resources.files("robojoule.robots") / "catalog"))


def robot_names() -> list[str]:
    """Names of the catalog's robots, sorted."""
    return sorted(path.stem for path in _catalog().glob("*.json"))


def load_robot_file(name: str | Path) -> RobotFile:
    """Load a robot file by its catalog name or path (YAML or JSON).

    Raises:
        InputError: Unknown name, or a bad robot file.
    """
    from robojoule.robots.model_file import RobotFile  # late: listing names needs no models

    path = Path(name)
    if path.suffix.lower() in (".json", ".yaml", ".yml"):
        return load(RobotFile, path)
    if str(name) not in robot_names():
        raise InputError(f"unknown robot '{name}'", allowed=f"{', '.join(robot_names())}, or the path of a robot file")
    return load(RobotFile, catalog_path(str(name)))


def load_robot(name: str | Path, payload: Payload | None = None) -> Robot:
    """Load a robot from the catalog or from a robot file (YAML or JSON).

    Args:
        name: Catalog name, or path of a robot file.
        payload: What it carries; nothing if not given.

    Raises:
        InputError: Unknown name, or a bad robot file.
    """
    from robojoule.robots.robot import Robot  # late: brings Pinocchio

    return Robot(load_robot_file(name), payload)
