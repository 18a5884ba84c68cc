"""Keys of files that may hold degrees instead of radians: in their JSON Schema, and on reading."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pydantic_core import PydanticCustomError

from robojoule.inputs import real


def accepts_degrees(stem: str, *, optional: bool = False) -> Any:
    """Edit a model's JSON Schema so that `<stem>_deg` may be given instead of `<stem>_rad`, or neither if optional."""
    radians, degrees = f"{stem}_rad", f"{stem}_deg"

    def edit(schema: dict[str, Any]) -> None:
        properties = {}
        for key, value in schema["properties"].items():
            properties[key] = value
            if key == radians:
                text = value["description"].replace("[rad]", f"[deg] Instead of {radians}.")
                properties[degrees] = {**value, "title": degrees.replace("_", " ").title(), "description": text}
        schema["properties"] = properties
        schema["required"] = [key for key in schema["required"] if key != radians]
        if optional:
            schema["not"] = {"required": [radians, degrees]}
        else:
            schema["oneOf"] = [{"required": [radians]}, {"required": [degrees]}]
        if "type" in properties:
            requires_type(schema)

    return edit


def requires_type(schema: dict[str, Any]) -> None:
    """Make `type` obligatory in files, though Python code need not repeat it."""
    schema["required"] = ["type", *schema["required"]]


def from_degrees(data: Any, stem: str, *, optional: bool = False) -> Any:
    """Replace `<stem>_deg` by `<stem>_rad` in raw input; exactly one of them must be there, or none if optional."""
    radians, degrees = f"{stem}_rad", f"{stem}_deg"
    if not isinstance(data, Mapping):
        return data
    if optional and radians not in data and degrees not in data:
        return data
    if (radians in data) == (degrees in data):
        raise ValueError(f"exactly one of {radians} and {degrees} must be given")
    if degrees not in data:
        return data
    values = data[degrees]
    if not isinstance(values, (list, tuple)) or not values or not all(_is_finite_number(value) for value in values):
        raise PydanticCustomError("degrees", "this must be a list of finite numbers", {"key": degrees})
    rest = {key: value for key, value in data.items() if key != degrees}
    return {**rest, radians: [math.radians(value) for value in values]}


def _is_finite_number(value: Any) -> bool:
    return math.isfinite(real(value))
