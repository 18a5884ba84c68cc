"""Files in and out: YAML and JSON validated on reading, whole or not at all on writing."""

from __future__ import annotations

import codecs
import json
import os
import tempfile
from collections.abc import Hashable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, nullcontext
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from robojoule.errors import InputError, each_of, refuse
from robojoule.inputs import LARGEST, shown


class Document(BaseModel):
    """Base of every file format: unknown keys, NaN and infinity are refused; values cannot be changed."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True)


D = TypeVar("D", bound=BaseModel)
_SUFFIXES = (".yaml", ".yml", ".json")
MOST_BYTES = 64 * 2**20  # of a file that is read as a whole
_MOST_YAML_BYTES = 4 * 2**20  # YAML needs some hundred bytes of memory for each of its own
_DEEPEST = 64  # lists and mappings within each other
_MOST_VALUES = 1_000_000


class _UniqueKeyLoader(yaml.CSafeLoader):
    """A YAML loader that refuses duplicate keys instead of keeping the last one."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[Any] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            line = key_node.start_mark.line + 1
            if not isinstance(key, Hashable):
                raise InputError(f"a list or a mapping is not a key (line {line})")
            if key in seen:
                raise InputError(f"key {_quoted(key)} appears twice (line {line})")
            seen.add(key)
        return super().construct_mapping(node, deep)


def _quoted(key: object) -> str:
    return f"'{key}'" if isinstance(key, str) else shown(key)


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
    return data_of(read_document_text(path), path)


def read_document_text(path: str | Path) -> str:
    """Read the text of a YAML or JSON file as it stands, without the mark that some editors put first.

    Raises:
        InputError: Another suffix, or see `read_bytes`; or it is not UTF-8.
    """
    path = Path(path)
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"unknown file type '{path.suffix}'", file=path, allowed=", ".join(_SUFFIXES))
    most_bytes = MOST_BYTES if path.suffix.lower() == ".json" else _MOST_YAML_BYTES
    return decoded(read_bytes(path, most_bytes), path)


def data_of(text: str, path: str | Path) -> Any:
    """Plain data of the text of a YAML or JSON file, told apart by the suffix of its path.

    Raises:
        InputError: See `read_document`.
    """
    path = Path(path)
    is_json = path.suffix.lower() == ".json"
    text = with_plain_line_ends(text)
    try:
        if is_json:
            data = json.loads(text, object_pairs_hook=_unique_pairs)
        else:
            _check_yaml(text)
            data = yaml.load(text, Loader=_UniqueKeyLoader)  # a CSafeLoader: builds plain data only
        _check_values(data)
    except InputError as error:
        raise InputError(error.problem, file=path, key=error.key, allowed=error.allowed) from None
    except RecursionError:
        raise _too_deep(path) from None
    except (json.JSONDecodeError, yaml.YAMLError) as error:
        raise _unreadable(path, error) from None
    except ValueError:
        raise InputError("a number has too many digits, or a date does not exist", file=path) from None
    return data


def _check_yaml(text: str) -> None:
    """Refuse lists in lists without end before the loader, which calls itself for each, runs out of its stack."""
    depth = 0
    for event in yaml.parse(text, Loader=yaml.CSafeLoader):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > _DEEPEST:
            raise _too_deep()


def _check_values(data: Any) -> None:
    """Refuse what no file of figures holds: lists in lists or values without end, numbers beyond all bounds."""
    pending: list[tuple[tuple[Any, ...], Any]] = [((), data)]
    seen = 0
    while pending:
        place, value = pending.pop()
        seen += 1
        if len(place) > _DEEPEST:
            raise _too_deep()
        if seen > _MOST_VALUES:  # a short file may repeat a list of lists of lists ... by its name
            raise InputError("the file holds too many values", allowed=f"at most {_MOST_VALUES}")
        if isinstance(value, (dict, list)):
            children = value.items() if isinstance(value, dict) else enumerate(value)
            pending += [((*place, key), child) for key, child in children]
        elif isinstance(value, (int, float)) and abs(value) > LARGEST:
            raise InputError(f"{shown(value)} is beyond all bounds", key=".".join(map(str, place)))


def _too_deep(path: Path | None = None) -> InputError:
    return InputError(f"lists and mappings are nested more than {_DEEPEST} deep", file=path)


def check_file(path: Path, most_bytes: int = MOST_BYTES) -> None:
    """Refuse a file that cannot be read as a whole, before it is opened: a pipe would wait, a device never end.

    Raises:
        InputError: There is no such file, it is a folder, a pipe or a device, or it is too large.
    """
    try:
        if not path.exists():
            raise InputError("there is no such file", file=path)
        if path.is_dir():
            raise InputError("this is a folder, not a file", file=path)
        if not path.is_file():
            raise InputError("this is a pipe or a device, not a file", file=path)
        if path.stat().st_size > most_bytes:
            raise InputError("the file is too large", file=path, allowed=f"{most_bytes // 2**20} MB")
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from None


def read_bytes(path: str | Path, most_bytes: int = MOST_BYTES) -> bytes:
    """Read a file as a whole.

    Raises:
        InputError: See `check_file`; or it cannot be read.
    """
    path = Path(path)
    check_file(path, most_bytes)
    try:
        return path.read_bytes()
    except OSError as error:
        raise _unreadable(path, error) from None


def read_text(path: str | Path, most_bytes: int = MOST_BYTES) -> str:
    """Read a text file, without the mark that some editors put first; its lines end as they do in Python.

    Raises:
        InputError: See `check_file`; or it is not UTF-8.
    """
    return text_of(read_bytes(path, most_bytes), path)


def text_of(content: bytes, path: str | Path) -> str:
    """The text of a file's content, see `read_text`."""
    return with_plain_line_ends(decoded(content, path))


def with_plain_line_ends(text: str) -> str:
    """A text with the line ends of Python."""
    return text.replace("\r\n", "\n").replace("\r", "\n")


def decoded(content: bytes, path: str | Path) -> str:
    """The text of a file's content with its own line ends, without the mark that some editors put first.

    Raises:
        InputError: It is not UTF-8.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        is_utf_16 = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        problem = "the file is UTF-16, not UTF-8 text" if is_utf_16 else "the file is not UTF-8 text"
        raise InputError(problem, file=path, allowed="a file that was saved as UTF-8") from None


def _unreadable(path: str | Path, error: Exception) -> InputError:
    return InputError(f"the file cannot be read ({reason(error)})", file=path)


def reason(error: Exception) -> str:
    """Why something failed, on one line, without the name of the file."""
    said = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(said.split())


def parse(model: type[D], data: Any, source: str | Path) -> D:
    """Validate `data` against `model`.

    Raises:
        InputError: Every violation, with its key and what is allowed.
    """
    try:
        return model.model_validate(data)
    except InputError as error:  # raised by a validator that knows the key, but not the file
        refuse([InputError(e.problem, file=source, key=e.key, allowed=e.allowed) for e in each_of(error)])
    except ValidationError as error:
        found = error.errors(include_url=False)
        # A misspelt key shows as an unknown one and a missing one: the unknown one points at the typing error.
        found.sort(key=lambda details: details["type"] != "extra_forbidden")
        refuse([_violation(details, model, source) for details in found])
    raise AssertionError("a refusal without a reason")


def _violation(details: ErrorDetails, model: type[BaseModel], source: str | Path) -> InputError:
    key = ".".join(str(part) for part in details["loc"]) or None
    if details["type"] == "extra_forbidden":
        names = _sibling_names(model, details["loc"][:-1])
        return InputError("unknown key", file=source, key=key, allowed=", ".join(names) or None)
    message = details["msg"].removeprefix("Value error, ")
    if details["type"] == "missing":
        return InputError("this key is missing", file=source, key=key)
    found_value = details["input"]
    if isinstance(found_value, (str, int, float, bool)) and not details["msg"].startswith("Value error, "):
        message = f"{message} (found {shown(found_value)})"
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


def check_output(path: Path, key: str | None = None) -> None:
    """Refuse a file that cannot be written, before any work is done.

    Args:
        path: The file to write.
        key: How messages name it.

    Raises:
        InputError: Its folder does not exist or cannot be written to, or the name is that of a folder or a device.
    """
    try:
        if path.is_dir():
            raise InputError("this is a folder, not a file", file=path, key=key)
        if path.exists() and not path.is_file():
            raise InputError("this is a pipe or a device, not a file", file=path, key=key)
        if not path.parent.is_dir():
            raise InputError(f"there is no folder {shown(str(path.parent))}", file=path, key=key)
        if not os.access(path.parent, os.W_OK):
            raise InputError("nothing can be written to this folder", file=path.parent, key=key)
    except (OSError, ValueError) as error:
        raise _unwritable(path, error) from None


def _unwritable(path: Path, error: Exception) -> InputError:
    return InputError(f"the file cannot be written ({reason(error)})", file=path)


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`; rename it on success, remove it on error.

    Raises:
        InputError: Nothing can be written there.
    """
    path = Path(path)
    temporary: Path | None = None
    try:
        if path.is_dir():  # or other files of a set would be renamed before this one fails
            raise InputError("this is a folder, not a file", file=path)
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=".", suffix=path.suffix, dir=path.parent)
        os.close(handle)
        temporary = Path(name)
        yield temporary
        temporary.chmod(0o644)  # mkstemp makes private files; results are for everybody
        temporary.replace(path)
    except (OSError, ValueError) as error:
        raise _unwritable(path, error) from None
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


_together: ContextVar[ExitStack | None] = ContextVar("together", default=None)


@contextmanager
def all_or_none() -> Iterator[None]:
    """Let whatever is written inside appear at the end, all of it or, on an error, nothing."""
    with ExitStack() as files:
        token = _together.set(files)
        try:
            yield
        finally:
            _together.reset(token)


def write_files(contents: Mapping[Path, str | bytes]) -> None:
    """Write several files, all of them or none.

    Raises:
        InputError: One of them cannot be written; names it.
    """
    around = _together.get()
    with ExitStack() if around is None else nullcontext(around) as files:  # each is renamed when all have been written
        for path, content in contents.items():
            temporary = files.enter_context(atomic_path(path))
            try:
                temporary.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)
            except (OSError, ValueError) as error:
                raise _unwritable(path, error) from None


def write_text(path: str | Path, text: str) -> None:
    """Write a text file atomically."""
    write_files({Path(path): text})


class _FlatListDumper(yaml.SafeDumper):
    """A YAML dumper that writes lists of plain values, such as joint positions, on one line."""

    def represent_sequence(self, tag: str, sequence: Any, flow_style: bool | None = None) -> yaml.SequenceNode:
        plain = all(isinstance(item, (int, float, str)) for item in sequence)
        return super().represent_sequence(tag, sequence, flow_style=plain or flow_style)


def document_text(suffix: str, data: Any) -> str:
    """Plain data as the text of a YAML or JSON file, keys in the given order."""
    if suffix.lower() == ".json":
        return json.dumps(data, indent=2, allow_nan=False) + "\n"
    text: str = yaml.dump(data, Dumper=_FlatListDumper, sort_keys=False, allow_unicode=True, width=120)
    return text


def write_document(path: str | Path, data: Any) -> None:
    """Write plain data as YAML or JSON (by suffix), atomically, keys in the given order.

    Raises:
        InputError: The suffix is neither YAML's nor JSON's, or the file cannot be written.
    """
    suffix = Path(path).suffix
    if suffix.lower() not in _SUFFIXES:
        raise InputError(f"unknown file type '{suffix}'", file=path, allowed=", ".join(_SUFFIXES))
    write_text(path, document_text(suffix, data))
