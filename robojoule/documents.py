"""YAML and JSON files in and out: validated on reading, atomic on writing."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from robojoule.errors import InputError


class Document(BaseModel):
    """Base of every file format: unknown keys, NaN and infinity are refused; values cannot be changed."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True)


D = TypeVar("D", bound=BaseModel)
_SUFFIXES = (".yaml", ".yml", ".json")


class _UniqueKeyLoader(yaml.CSafeLoader):
    """A YAML loader that refuses duplicate keys instead of keeping the last one."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[Any] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if key in seen:
                raise InputError(f"key '{key}' appears twice (line {key_node.start_mark.line + 1})")
            seen.add(key)
        return super().construct_mapping(node, deep)


def _unique_pairs(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in pairs:
        if key in result:
            raise InputError(f"key '{key}' appears twice")
        result[key] = value
    return result


def read_document(path: str | Path) -> Any:
    """Read a YAML or JSON file, told apart by its suffix.

    Raises:
        InputError: The file is missing, unreadable, truncated or has duplicate keys.
    """
    path = Path(path)
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"unknown file type '{path.suffix}'", file=path, allowed=", ".join(_SUFFIXES))
    text = read_text(path)
    try:
        if path.suffix.lower() == ".json":
            return json.loads(text, object_pairs_hook=_unique_pairs)
        return yaml.load(text, Loader=_UniqueKeyLoader)  # a CSafeLoader: builds plain data only
    except InputError as error:
        raise InputError(error.problem, file=path) from None
    except (json.JSONDecodeError, yaml.YAMLError) as error:
        raise _unreadable(path, error) from None


def read_text(path: str | Path) -> str:
    """Read a text file.

    Raises:
        InputError: The file is missing, unreadable or not UTF-8.
    """
    try:
        return Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError("there is no such file", file=path) from None
    except UnicodeDecodeError:
        raise InputError("the file is not UTF-8 text", file=path) from None
    except OSError as error:
        raise _unreadable(path, error) from None


def _unreadable(path: str | Path, error: Exception) -> InputError:
    return InputError(f"the file cannot be read ({' '.join(str(error).split())})", file=path)


def parse(model: type[D], data: Any, source: str | Path) -> D:
    """Validate `data` against `model`.

    Raises:
        InputError: First violation, with its key and what is allowed.
    """
    try:
        return model.model_validate(data)
    except InputError as error:  # raised by a validator that knows the key, but not the file
        raise InputError(error.problem, file=source, key=error.key, allowed=error.allowed) from None
    except ValidationError as error:
        raise _first_error(error, model, source) from None


def _first_error(error: ValidationError, model: type[BaseModel], source: str | Path) -> InputError:
    found = error.errors(include_url=False)
    # A misspelt key shows as an unknown one and a missing one: the unknown one points at the typing error.
    details = next((item for item in found if item["type"] == "extra_forbidden"), found[0])
    key = ".".join(str(part) for part in details["loc"]) or None
    if details["type"] == "extra_forbidden":
        names = _sibling_names(model, details["loc"][:-1])
        return InputError("unknown key", file=source, key=key, allowed=", ".join(names) or None)
    message = details["msg"].removeprefix("Value error, ")
    if details["type"] == "missing":
        return InputError("this key is missing", file=source, key=key)
    shown = details["input"]
    if isinstance(shown, (str, int, float, bool)) and not details["msg"].startswith("Value error, "):
        message = f"{message} (found {shown!r})"
    return InputError(message[:1].lower() + message[1:], file=source, key=key)


def _sibling_names(model: type[BaseModel], location: tuple[int | str, ...]) -> list[str]:
    """Names of the fields beside an unknown key, found by walking the model along its location."""
    current: type[BaseModel] | None = model
    for part in location:
        field = current.model_fields.get(str(part)) if current else None
        if field is None:
            continue
        candidates = [field.annotation, *getattr(field.annotation, "__args__", ())]
        current = next((c for c in candidates if isinstance(c, type) and issubclass(c, BaseModel)), None)
    return sorted(current.model_fields) if current else []


def load(model: type[D], path: str | Path) -> D:
    """Read and validate a file.

    Raises:
        InputError: See `read_document` and `parse`.
    """
    return parse(model, read_document(path), path)


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`; rename it on success, remove it on error.

    Raises:
        InputError: Nothing can be written there.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise InputError(f"the file cannot be written ({error.strerror})", file=path) from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)  # mkstemp makes private files; results are for everybody
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file atomically."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


class _FlatListDumper(yaml.SafeDumper):
    """A YAML dumper that writes lists of plain values, such as joint positions, on one line."""

    def represent_sequence(self, tag: str, sequence: Any, flow_style: bool | None = None) -> yaml.SequenceNode:
        plain = all(isinstance(item, (int, float, str)) for item in sequence)
        return super().represent_sequence(tag, sequence, flow_style=plain or flow_style)


def write_document(path: str | Path, data: Any) -> None:
    """Write plain data as YAML or JSON (by suffix), atomically, keys in the given order.

    Raises:
        InputError: The suffix is neither YAML's nor JSON's.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in _SUFFIXES:
        raise InputError(f"unknown file type '{suffix}'", file=path, allowed=", ".join(_SUFFIXES))
    if suffix == ".json":
        write_text(path, json.dumps(data, indent=2, allow_nan=False) + "\n")
    else:
        text = yaml.dump(data, Dumper=_FlatListDumper, sort_keys=False, allow_unicode=True, width=120)
        write_text(path, text)
