"""The catalog of robots: one file per arm, published figures with source and licence."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from robojoule.documents import load, read_document
from robojoule.errors import InputError
from robojoule.inputs import as_path, unknown_name
from robojoule.robots.robot_file import RobotFile
from robojoule.robots.robot_loading import robot_file_of

if TYPE_CHECKING:
    from robojoule.robots.robot import Payload, Robot


def catalog_path(name: str) -> Path:
    """File of a catalog entry, whether it exists or not."""
    return _catalog() / f"{name}.json"


def _catalog() -> Path:
    return Path(str(resources.files("robojoule") / "catalog"))


def list_robots() -> list[str]:
    """Names of the catalog's robots, sorted."""
    return sorted(path.stem for path in _catalog().glob("*.json"))


def load_robot_file(name: str | Path, drives: str | Path | None = None) -> RobotFile:
    """Load a robot file by its catalog name or path.

    Args:
        name: Catalog name, or path of a robot file (YAML or JSON) or URDF.
        drives: Drive file of a URDF; if not given, the one beside it (`arm.drives.yaml` beside `arm.urdf`).

    Raises:
        InputError: Unknown name, or a bad robot file, URDF or drive file.
    """
    return _load(name, drives)[0]


def _load(name: str | Path, drives: str | Path | None) -> tuple[RobotFile, str]:
    """A robot file, and where it was read from, as messages say it."""
    path = as_path(name, "robot")
    drives = as_path(drives, "drives") if drives is not None else None
    suffix = path.suffix.lower()
    if suffix == ".urdf":
        from robojoule.robots.urdf import load_urdf, urdf_source

        return load_urdf(path, drives), urdf_source(path, drives)
    if drives is not None:
        raise InputError("a drive file goes with a URDF only: a robot file holds its drives", file=drives)
    if suffix == ".xacro":
        from robojoule.robots.urdf_elements import xacro_error

        raise xacro_error(path)
    if suffix in (".json", ".yaml", ".yml"):
        return robot_file_of(read_document(path), str(path)), str(path)
    if str(path) not in list_robots():
        allowed = "a name that list_robots or `robojoule robots` shows, or the path of a robot file or URDF"
        raise unknown_name("robot", str(path), list_robots(), allowed)
    path = catalog_path(str(path))
    return load(RobotFile, path), str(path)


def load_robot(
    name: str | Path,
    payload: Payload | None = None,
    *,
    payload_kg: float | None = None,
    drives: str | Path | None = None,
) -> Robot:
    """Load a robot from the catalog, a robot file or a URDF.

    Args:
        name: Catalog name, or path of a robot file (YAML or JSON) or URDF.
        payload: What it carries; nothing if not given.
        payload_kg: Its mass alone, instead of `payload`; its centre of mass is `Payload`'s. [kg]
        drives: Drive file of a URDF; if not given, the one beside it.

    Raises:
        InputError: Unknown name, a bad robot file, URDF or drive file, or a payload above the rated one.
    """
    from robojoule.robots.robot import Payload, Robot  # late: listing robots needs no numpy

    if payload_kg is not None:
        if payload is not None:
            raise InputError("a payload and its mass are both given", key="payload_kg", allowed="one of the two")
        payload = Payload(payload_kg)
    file, source = _load(name, drives)
    robot = Robot(file, payload, source)
    if source != str(catalog_path(file.name)):  # tests look at the catalog's
        robot.doubts  # noqa: B018  refuses figures in a wrong unit
    return robot
