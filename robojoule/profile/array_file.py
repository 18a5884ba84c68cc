"""A predictor's folder: `predictor.json` says what it is, `predictor.npz` holds its arrays.

Both have stable bytes: the same predictor gives the same files. No code of a file runs on reading.
"""

from __future__ import annotations

import struct
import tokenize
import zipfile
import zlib
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

# What numpy and zipfile raise for files that are damaged, encrypted, or made to be so.
_UNREADABLE = (
    *(OSError, EOFError, ValueError, TypeError, IndexError, RuntimeError, SyntaxError),
    *(tokenize.TokenError, zipfile.BadZipFile, zlib.error, struct.error),
)


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
        _check_sizes(path)
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
    except MemoryError:
        raise InputError("the file does not hold a predictor (an array is larger than the file)", file=path) from None
    except _UNREADABLE as error:
        first = " ".join(str(error).split())
        raise InputError(f"the file does not hold a predictor ({first})", file=path) from None


def _check_sizes(path: Path) -> None:
    """Refuse what unpacks to more than it is; `write_arrays` does not compress.

    Raises:
        ValueError: The arrays are compressed.
    """
    with zipfile.ZipFile(path) as archive:
        if sum(member.file_size for member in archive.infolist()) > path.stat().st_size:
            raise ValueError("its arrays are compressed")
