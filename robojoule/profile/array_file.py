"""Arrays of a predictor as an `.npz` file with stable bytes, read without running any code of the file."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from robojoule.documents import atomic_path
from robojoule.errors import InputError

Arrays = dict[str, np.ndarray[Any, Any]]
Made = TypeVar("Made")

_EPOCH = (1980, 1, 1, 0, 0, 0)  # the zip format's earliest date: no file may tell when it was written


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Write arrays; the same arrays in the same order give the same bytes."""
    with atomic_path(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name, array in arrays.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy", _EPOCH), "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, np.ascontiguousarray(array), allow_pickle=False)


def read_arrays(path: Path, assemble: Callable[[Arrays], Made]) -> Made:
    """Read arrays, all of finite numbers, and make something of them.

    Args:
        path: The file.
        assemble: Takes the arrays by name; raises ValueError where they do not fit together.

    Raises:
        InputError: The file is missing, truncated, or does not hold what `assemble` needs.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        for name, array in arrays.items():
            if not np.isfinite(array).all():
                raise ValueError(f"the array '{name}' holds values that are no finite numbers")
        return assemble(arrays)
    except FileNotFoundError:
        raise InputError("there is no such file", file=path) from None
    except KeyError as error:
        raise InputError(f"the array {error} is missing", file=path) from None
    except (OSError, EOFError, ValueError, IndexError, zipfile.BadZipFile) as error:
        first = " ".join(str(error).split())
        raise InputError(f"the file holds no predictor ({first})", file=path) from None
