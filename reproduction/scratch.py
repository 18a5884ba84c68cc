"""Finished parts of an unfinished stage: kept until its outputs are written, so that a run that was killed goes on.

Parts are found again by a key of all that they depend on: code, versions of packages, parameters and inputs.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import time
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from robojoule.documents import reason
from robojoule.errors import InputError

_ROOT = Path(__file__).resolve().parents[1]
_CODE = ("robojoule", "reproduction", "stages")
_PACKAGES = ("highspy", "numpy", "pin", "pyarrow", "pyomo", "ruckig", "scikit-learn", "scipy")
_ENVIRONMENT = ("OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES")  # decide last digits
_KEPT_S = 7 * 24 * 3600.0


@cache
def code_hash() -> str:
    """Hash of the code and of the packages and instructions that it computes with."""
    found = hashlib.sha256()
    for folder in _CODE:
        for path in sorted((_ROOT / folder).rglob("*")):
            if path.suffix in (".py", ".json", ".yaml", ".sql") and path.is_file():
                found.update(path.relative_to(_ROOT).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    for package in _PACKAGES:
        try:
            found.update(f"{package} {version(package)}\n".encode())
        except PackageNotFoundError:
            found.update(f"{package} is missing\n".encode())
    for name in _ENVIRONMENT:
        found.update(f"{name}={os.environ.get(name)}\n".encode())
    return found.hexdigest()


def scratch_folder(stage_dir: Path, params: Mapping[str, object], inputs: Iterable[bytes]) -> Path:
    """Folder of the parts that this code makes with these parameters from these inputs.

    Folders of other keys that nobody has used for a week are removed.

    Args:
        stage_dir: Where the parts of the stage are.
        params: Parameters, as plain data.
        inputs: The inputs' content.
    """
    key = hashlib.sha256(code_hash().encode())
    key.update(json.dumps(params, sort_keys=True).encode())
    for content in inputs:
        key.update(hashlib.sha256(content).digest())
    folder = stage_dir / key.hexdigest()[:32]
    for other in stage_dir.glob("*"):
        if other != folder and time.time() - other.stat().st_mtime > _KEPT_S:
            shutil.rmtree(other, ignore_errors=True)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"nothing can be written there ({reason(error)})", file=folder) from None
    for stale in folder.rglob(".*"):  # begun by one that was killed
        stale.unlink(missing_ok=True)
    return folder


def replace_folder(target: Path, files: Mapping[str, Path]) -> None:
    """Put files into a folder that takes the place of another one; that goes only when the new one is complete.

    Args:
        target: The folder.
        files: Name in it -> file, which stays where it is (linked, or copied where there are no links).

    Raises:
        InputError: Nothing can be written there.
    """
    new, old = (target.with_name(f".{target.name}-{word}") for word in ("new", "old"))
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        for left in (new, old):
            shutil.rmtree(left, ignore_errors=True)
        new.mkdir()
        for name, path in files.items():
            try:
                os.link(path, new / name)
            except OSError:
                shutil.copyfile(path, new / name)
        if target.exists():
            target.rename(old)
        new.rename(target)
        shutil.rmtree(old, ignore_errors=True)
    except OSError as error:
        raise InputError(f"the folder cannot be written ({reason(error)})", file=target) from None
