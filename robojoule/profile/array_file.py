"""A predictor's folder: `predictor.json` says what it is, `predictor.npz` holds its arrays.

Both have stable bytes: the same predictor gives the same files. No code of a file runs on reading.
"""

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

DESCRIPTION = "predictor.json"
ARRAYS = "predictor.npz"


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Write arrays by name."""
    with atomic_path(path) as temporary:
        np.savez(temporary, allow_pickle=False, **arrays)


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
                raise ValueError(f"the array '{name}' holds values that are not finite numbers")
        return assemble(arrays)
    except FileNotFoundError:
        raise InputError("there is no such file", file=path) from None
    except KeyError as error:
        raise InputError(f"the array {error} is missing", file=path) from None
    except (OSError, EOFError, ValueError, TypeError, IndexError, zipfile.BadZipFile) as error:
        first = " ".join(str(error).split())
        raise InputError(f"the file does not hold a predictor ({first})", file=path) from None
