"""Values of RAPID expressions as far as constants reach."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from lark import Token, Tree

from robojoule.formats.vendor.rapid.data import component, floats, predefined, rotation_of
from robojoule.formats.vendor.rapid.syntax import Node, Statement
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, computed, logic, number
from robojoule.robots.rigid_body import Placement, quaternions

Path = tuple[str | int, ...]
_MOST_DEPTH = 60
_ARITHMETIC: Mapping[str, Callable[[float, float], float]] = {
    "op_add": lambda a, b: a + b,
    "op_sub": lambda a, b: a - b,
    "op_mul": lambda a, b: a * b,
    "op_div": lambda a, b: a / b,
    "op_whole_div": lambda a, b: float(int(a / b)),
    "op_mod": lambda a, b: math.fmod(a, b),
}
_COMPARISONS: Mapping[str, Callable[[Value, Value], bool]] = {
    "=": lambda a, b: bool(a == b),
    "<>": lambda a, b: bool(a != b),
    "<": lambda a, b: bool(a < b),
    ">": lambda a, b: bool(a > b),
    "<=": lambda a, b: bool(a <= b),
    ">=": lambda a, b: bool(a >= b),
}
_FUNCTIONS: Mapping[str, Callable[[float], float]] = {
    "ABS": abs,
    "SQRT": math.sqrt,
    "SIN": lambda degrees: math.sin(math.radians(degrees)),
    "COS": lambda degrees: math.cos(math.radians(degrees)),
    "TRUNC": lambda value: float(math.trunc(value)),
    "ROUND": lambda value: float(math.floor(value + 0.5)),
}


class Variables:
    """Data by their names in capitals; records and arrays are lists."""

    def __init__(self) -> None:
        self.values: dict[str, Value] = predefined()
        self.fixed = set(self.values)  # names whose values nothing changes
        self.read: set[str] = set()  # names whose values were asked for
        self.changing: set[str] = set()  # names whose values may change at any time

    def get(self, path: Path) -> Value:
        """The value at a path of a name, components and numbers from 1 on."""
        name, *inner = path
        self.read.add(str(name))
        value: Value = UNKNOWN if name in self.changing else self.values.get(str(name), UNKNOWN)
        for part in inner:
            place = _place(part, value)
            if place is None:
                return UNKNOWN
            value = value[place]
        return value

    def set(self, path: Path, value: Value) -> None:
        """Set a value, or a part of one."""
        name, *inner = path
        self.values[str(name)] = _changed(self.values.get(str(name), UNKNOWN), inner, value)

    def forget(self, name: str) -> None:
        """The value of a name is not known any more."""
        if name.upper() not in self.fixed:
            self.values[name.upper()] = UNKNOWN


def _place(part: str | int, value: Value) -> int | None:
    if not isinstance(value, list):
        return None
    if isinstance(part, int):
        return part - 1 if 1 <= part <= len(value) else None
    return component(part, value)


def _changed(old: Value, path: list[str | int], value: Value) -> Value:
    if not path:
        return value
    place = _place(path[0], old)
    if place is None:
        return UNKNOWN
    return [*old[:place], _changed(old[place], path[1:], value), *old[place + 1 :]]


def path_of(node: Node, statement: Statement, variables: Variables, depth: int = 0) -> Path | None:
    """The path that a reference names; None: an index is not known."""
    path: list[str | int] = []
    for child in node.children:
        if isinstance(child, Token):
            path.append(str(child).upper() if not path else str(child))
            continue
        indices = [number(value_of(one, statement, variables, depth)) for one in child.children]
        for index in indices:
            if index is None or not index.is_integer():
                return None
            path.append(int(index))
    return tuple(path)


def value_of(node: Node | Token, statement: Statement, variables: Variables, depth: int = 0) -> Value:
    """What an expression is; `UNKNOWN` where constants do not reach."""
    if isinstance(node, Token) or depth > _MOST_DEPTH:
        return UNKNOWN
    depth += 1
    kind, inner = str(node.data), node.children
    if kind == "number":
        return _literal(str(inner[0]), statement, node)
    if kind == "string":
        return str(inner[0])[1:-1].replace('""', '"')
    if kind in ("true", "false"):
        return kind == "true"
    if kind == "aggregate":
        return [value_of(one, statement, variables, depth) for one in inner]
    if kind == "ref":
        path = path_of(node, statement, variables, depth)
        return UNKNOWN if path is None else variables.get(path)
    if kind == "function":
        return _function(node, statement, variables, depth)
    values = [value_of(one, statement, variables, depth) for one in inner if isinstance(one, Tree)]
    if kind in _ARITHMETIC:
        return _arithmetic(kind, values)
    if kind == "op_neg":
        return computed(Number(0.0), values[0], lambda a, b: a - b)
    if kind == "op_compare":
        return _compared(str(inner[1]), values)
    if kind == "op_not":
        return not values[0] if isinstance(values[0], bool) else UNKNOWN
    return logic(kind, values[0], values[-1])


def _literal(text: str, statement: Statement, node: Node) -> Number:
    value = float(int(text, 16)) if text.lower().startswith("0x") else float(text)
    return Number(value, statement.span(node), value.is_integer())


def _arithmetic(kind: str, values: list[Value]) -> Value:
    first, second = values
    if isinstance(first, str) and isinstance(second, str) and kind == "op_add":
        return first + second
    if isinstance(first, list) and isinstance(second, list) and len(first) == len(second) == 3:
        return [computed(a, b, _ARITHMETIC[kind]) for a, b in zip(first, second, strict=True)]  # pos + pos
    return computed(first, second, _ARITHMETIC[kind])


def _compared(sign: str, values: list[Value]) -> Value:
    first, second = (number(value) if isinstance(value, Number) else value for value in values)
    same = isinstance(first, (float, int)) and isinstance(second, (float, int))
    same = same or (isinstance(first, str) and isinstance(second, str))
    return _COMPARISONS[sign](first, second) if same else UNKNOWN


def arguments_of(node: Node) -> tuple[list[Node | Token], dict[str, Node | Token | None]]:
    """Arguments of a call in order, and optional ones by their names in capitals, None being a bare switch."""
    plain: list[Node | Token] = []
    named: dict[str, Node | Token | None] = {}
    for group in node.children:
        if not (isinstance(group, Tree) and group.data == "arguments"):
            continue
        for one in group.children:
            if isinstance(one, Tree) and one.data == "switch":
                named[str(one.children[0]).upper()] = one.children[1] if len(one.children) > 1 else None
            else:
                plain.append(one)
    return plain, named


def _function(node: Node, statement: Statement, variables: Variables, depth: int) -> Value:
    name = str(node.children[0]).upper()
    plain, named = arguments_of(node)
    values = [value_of(one, statement, variables, depth) for one in plain]
    if name in _FUNCTIONS and len(values) == 1:
        return computed(values[0], Number(0.0), lambda a, _: _FUNCTIONS[name](a))
    if name in ("OFFS", "RELTOOL") and len(values) == 4:
        turns = {
            key: value_of(one, statement, variables, depth) if one is not None else UNKNOWN
            for key, one in named.items()
        }
        return _moved(name, values, turns)
    if name == "ORIENTZYX" and len(values) == 3:
        angles = floats(values, 3)
        if angles is None:
            return UNKNOWN
        z, y, x = (math.radians(angle) for angle in angles)
        return _orient(Placement.of((0.0, 0.0, 0.0), (x, y, z)))
    return UNKNOWN


def _moved(name: str, values: list[Value], turns: Mapping[str, Value]) -> Value:
    """A robtarget that is moved along axes of the work object (Offs) or of the tool (RelTool)."""
    target, by = values[0], floats(values[1:], 3)
    if not isinstance(target, list) or len(target) != 4 or by is None:
        return UNKNOWN
    origin, rotation = floats(target[0], 3), rotation_of(target[1])
    if origin is None or rotation is None:
        return UNKNOWN
    if name == "OFFS":
        return [[Number(a + b) for a, b in zip(origin, by, strict=True)], *target[1:]]
    angles = [number(turns.get(axis, Number(0.0))) for axis in ("RX", "RY", "RZ")]
    if any(angle is None for angle in angles):
        return UNKNOWN
    place = Placement(rotation, np.array(origin)) @ Placement(np.eye(3), np.array(by))
    for axis, angle in enumerate(angles):
        turn = [0.0, 0.0, 0.0]
        turn[axis] = math.radians(angle or 0.0)
        place = place @ Placement.of((0.0, 0.0, 0.0), (turn[0], turn[1], turn[2]))
    return [[Number(float(part)) for part in place.origin_m], _orient(place), *target[2:]]


def _orient(place: Placement) -> Value:
    return [Number(float(part)) for part in quaternions(place.rotation[..., None])[0]]
