"""Operation trees as YAML or JSON files: reading with clear errors, writing, JSON Schema."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from robojoule.documents import data_of, document_text, read_document_text, write_document, write_text
from robojoule.errors import InputError
from robojoule.formats.exact_degrees import in_exact_degrees
from robojoule.formats.format import Reading
from robojoule.formats.tree_text import text_with_plan, text_with_remarks
from robojoule.inputs import shown
from robojoule.programs.operation_tree import (
    CoarseZone,
    CompoundOperation,
    MoveOperation,
    OperationTree,
    PayloadOperation,
    ProcessOperation,
    ShareZone,
    ToolPath,
    UnknownOperation,
    WaitOperation,
)

SCHEMA_FILE = Path(__file__).with_name("operation-tree.schema.json")
_MODELS: dict[str, type[BaseModel]] = {
    "compound": CompoundOperation,
    "move": MoveOperation,
    "wait": WaitOperation,
    "process": ProcessOperation,
    "payload": PayloadOperation,
    "unknown": UnknownOperation,
}
_MEMBERS: dict[str, type[BaseModel]] = {"coarse": CoarseZone, "share": ShareZone, "tool": ToolPath}


class TreeFiles:
    """Files of operation trees.

    Angles are in radians or degrees when read; they are written as they were, or else in degrees if these read as the
    very same radians.
    """

    name = "operation tree"
    suffixes: tuple[str, ...] = (".yaml", ".yml", ".json")
    speed_step_percent = 1.0

    def read(self, path: Path) -> Reading:
        """Read a file; see `robojoule.formats.format.Format`."""
        text = read_document_text(path)
        data = data_of(text, path)
        return Reading(parse_tree(data, path), _keys_in_degrees(data), text)

    def write(
        self, tree: OperationTree, path: Path, text: str | None = None, remarks: Sequence[str] | None = None
    ) -> None:
        """Write a file; see `robojoule.formats.format.Format`.

        Args:
            tree: See there.
            path: See there.
            text: See there.
            remarks: What comments of a YAML file shall say of the plan, in place of those of an earlier plan; if not
                given, these stay as long as the plan does.
        """
        kept = None if text is None else text_with_plan(text, tree)
        if kept is not None and _held(kept, path, path) == tree:
            content = kept
        elif kept is not None and _held(kept, path, Path("any.yaml")) == tree:  # from YAML to JSON or back
            content = document_text(path.suffix, data_of(kept, "any.yaml"))
        else:
            content = document_text(path.suffix, tree_to_data(tree, as_degrees=True))
        if path.suffix.lower() != ".json" and (remarks is not None or content != text):
            content = text_with_remarks(content, remarks or ())
        write_text(path, content)


def _held(text: str, path: Path, read_as: Path) -> OperationTree | None:
    """The tree that a text would be read as in a file of some name, if any."""
    try:
        return parse_tree(data_of(text, read_as), path)
    except InputError:
        return None


def parse_tree(data: Any, source: str | Path) -> OperationTree:
    """Validate plain data as an operation tree.

    Args:
        data: What a YAML or JSON file holds.
        source: Name of the file for messages.

    Raises:
        InputError: First violation, with its key and the operation's name.
    """
    if not isinstance(data, Mapping):
        raise InputError("an operation tree must be a mapping with the key operations", file=source)
    try:
        return OperationTree.model_validate(data)
    except ValidationError as error:
        raise _explain(error, data, source) from None


def save_tree(tree: OperationTree, path: str | Path) -> None:
    """Write an operation tree as YAML or JSON (by suffix), atomically; angles in radians, defaults left out.

    Raises:
        InputError: The suffix is neither YAML's nor JSON's.
    """
    write_document(path, tree_to_data(tree))


def tree_to_data(tree: OperationTree, *, as_degrees: bool = False) -> dict[str, Any]:
    """Plain data of a tree as it stands in a file; `parse_tree` of it gives the same tree.

    Args:
        tree: The tree.
        as_degrees: Whether to give angles in degrees, if these read as the very same radians.
    """
    targets = [one.target_rad for one in tree.atomic() if isinstance(one, (MoveOperation, UnknownOperation))]
    positions = [tree.start_rad, *(target for target in targets if target is not None)]
    degrees = in_exact_degrees(positions) if as_degrees else None
    pending = iter(degrees or ())

    def compact(operation: dict[str, Any]) -> dict[str, Any]:
        fields = _MODELS[operation["type"]].model_fields
        kept = {k: v for k, v in operation.items() if k in ("type", "zone") or v != fields[k].default}
        if isinstance(kept.get("path"), dict):
            defaults = ToolPath.model_fields
            kept["path"] = {k: v for k, v in kept["path"].items() if k == "type" or not _is(defaults[k].default, v)}
        if "operations" in kept:
            kept["operations"] = [compact(child) for child in kept["operations"]]
        return in_unit(kept, "target")

    def in_unit(data: dict[str, Any], stem: str) -> dict[str, Any]:
        """Data whose angles, if it has any, are those that come next in degrees, if all are to be in degrees."""
        radians = f"{stem}_rad"
        if degrees is None or radians not in data:
            return data
        return {f"{stem}_deg" if k == radians else k: next(pending) if k == radians else v for k, v in data.items()}

    data = in_unit(tree.model_dump(mode="json"), "start")
    for key in ("robot", "angles", "planned_cycle_s"):
        if data[key] == OperationTree.model_fields[key].default:
            del data[key]
    return {**data, "operations": [compact(operation) for operation in data["operations"]]}


def _is(default: Any, value: Any) -> bool:
    return bool(value == (list(default) if isinstance(default, tuple) else default))


def _keys_in_degrees(data: Mapping[str, Any]) -> dict[str, str]:
    """Keys of configurations that a file gives in degrees, by their keys in the tree."""
    found = {"start_rad": "start_deg"} if "start_deg" in data else {}

    def descend(operations: Sequence[Mapping[str, Any]], key: str) -> None:
        for index, operation in enumerate(operations):
            place = f"{key}.{index}"
            if "target_deg" in operation:
                found[f"{place}.target_rad"] = f"{place}.target_deg"
            descend(operation.get("operations", ()), f"{place}.operations")

    descend(data["operations"], "operations")
    return found


def operation_tree_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the file format, generated from the models."""
    schema = OperationTree.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def write_schema() -> None:
    """Write the JSON Schema that is shipped with the package anew."""
    write_document(SCHEMA_FILE, operation_tree_schema())


def _explain(error: ValidationError, data: Any, source: str | Path) -> InputError:
    """Turn pydantic's first finding into one sentence with the key as it stands in the file."""
    details = error.errors(include_url=False)[0]
    kind, location = details["type"], details["loc"]
    parts, model, name = _place(data, location, missing=kind == "missing")
    key = ".".join(str(part) for part in parts) or None
    context = details.get("ctx", {})
    allowed: str | None = None
    if kind == "degrees":
        problem, key = details["msg"], ".".join(str(part) for part in (*parts, context["key"]))
    elif kind == "extra_forbidden":
        problem, allowed = "unknown key", ", ".join(_keys(model))
    elif kind == "missing":
        problem = "this key is missing"
    elif kind == "union_tag_not_found":
        problem, allowed = "this key is missing", ", ".join(_MODELS)
        key, name = f"{key}.type", _name_of(details["input"])
    elif kind == "union_tag_invalid":
        problem, allowed = f"unknown operation type '{context.get('tag')}'", ", ".join(_MODELS)
        key, name = f"{key}.type", _name_of(details["input"])
    elif kind == "tree":
        problem, key, name = context["problem"], context["key"], None
    elif kind == "recursion_loop":
        problem = "the operations contain themselves"
    elif kind == "tuple_type":
        problem = "this must be a list"
    elif kind == "model_attributes_type":
        problem = f"an operation must be a mapping (found {shown(details['input'])})"
    elif kind == "too_short":
        problem = "the list is empty"
    else:
        problem = details["msg"].removeprefix("Value error, ")
        problem = problem[:1].lower() + problem[1:]
        found = details["input"]
        if kind != "value_error" and isinstance(found, (str, int, float, bool)):
            problem = f"{problem} (found {shown(found)})"
    if name is not None and kind != "recursion_loop":
        problem = f"operation '{name}': {problem}"
    return InputError(problem, file=source, key=key, allowed=allowed)


def _place(
    data: Any, location: tuple[int | str, ...], *, missing: bool
) -> tuple[list[int | str], type[BaseModel], str | None]:
    """Follow pydantic's location through the raw data.

    Pydantic inserts the tag of a union member ("move") that is not a key of the file: such parts are left out.

    Returns:
        Key parts as in the file, the model that is valid at that place, and the name of the operation there.
    """
    parts: list[int | str] = []
    model: type[BaseModel] = OperationTree
    name: str | None = None
    here = data
    for index, part in enumerate(location):
        is_last = index == len(location) - 1
        if isinstance(here, Mapping):
            if part == here.get("type") and part in _MODELS and not (is_last and part in here):
                model = _MODELS[str(part)]
                name = _name_of(here)
                continue
            if part in _MEMBERS:
                model = _MEMBERS[str(part)]
                continue
            if part not in here and not (missing and is_last):
                continue
            parts.append(part)
            here = here.get(part)
        elif isinstance(here, (list, tuple)) and isinstance(part, int):
            parts.append(part)
            here = here[part] if part < len(here) else None
    return parts, model, name


def _name_of(data: Any) -> str | None:
    name = data.get("name") if isinstance(data, Mapping) else None
    return name if isinstance(name, str) else None


def _keys(model: type[BaseModel]) -> list[str]:
    """Keys that may stand in a file at the place of `model`."""
    return sorted(model.model_json_schema(ref_template="{model}").get("properties") or model.model_fields)
