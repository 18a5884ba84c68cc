"""Expressions of URScript as far as constants reach; poses are placements, lists are tuples."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from lark import Token, Tree

from robojoule.formats.vendor.lines import Line, Node
from robojoule.formats.vendor.ur.names import Names
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, computed, logic
from robojoule.robots.inverse_kinematics import inverse_of
from robojoule.robots.rigid_body import Placement

_MOST_DEPTH = 60
_FUNCTIONS: dict[str, Callable[..., float]] = {
    "d2r": math.radians,
    "r2d": math.degrees,
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "atan2": math.atan2,
    "floor": math.floor,
    "ceil": math.ceil,
    "pow": math.pow,
    "log": lambda base, x: math.log(x, base),
}
_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
}


@dataclass(frozen=True, eq=False)
class Pose:
    """A pose p[x, y, z, rx, ry, rz].

    Attributes:
        place: What it says. [m]
        near_rad: Joint positions that its inverse kinematics is to be near to; none: those before the motion. [rad]
    """

    place: Placement
    near_rad: tuple[float, ...] | None = None


Evaluate = Callable[[Node | Token], Value]


def pose_of(values: Sequence[float]) -> Placement:
    """A placement by x, y, z [m] and a rotation vector [rad]."""
    vector = np.array(values[3:])
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return Placement(np.eye(3), np.array(values[:3]))
    x, y, z = (vector / angle).tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
    return Placement(rotation, np.array(values[:3]))


def numbers_in(value: Value, count: int) -> tuple[float, ...] | None:
    """A list of so many known numbers."""
    if not isinstance(value, tuple) or len(value) != count or not all(isinstance(one, Number) for one in value):
        return None
    return tuple(one.value for one in value)


def six_numbers(value: Value) -> tuple[float, ...] | None:
    """A list of six known numbers."""
    return numbers_in(value, 6)


def value_of(node: Node | Token, line: Line, names: Names, depth: int = 0) -> Value:
    """The value of an expression; `UNKNOWN` where constants do not reach."""
    if isinstance(node, Token) or depth > _MOST_DEPTH:
        return UNKNOWN

    def inner(one: Node | Token) -> Value:
        return value_of(one, line, names, depth + 1)

    kind, parts = str(node.data), node.children
    if kind == "number":
        text = str(parts[0])
        return Number(float(text), line.span(parts[0]), text.isdigit())
    if kind == "name":
        return names.get(str(parts[0]))
    if kind in ("true", "false"):
        return kind == "true"
    if kind == "string":
        return str(parts[0])[1:-1]
    if kind in ("list", "pose"):
        items = tuple(inner(one) for one in parts[-1].children) if isinstance(parts[-1], Tree) else ()
        if kind == "list":
            return items
        numbers = six_numbers(items)
        return UNKNOWN if numbers is None else Pose(pose_of(numbers))
    if kind == "item":
        return _item(inner(parts[0]), inner(parts[1].children[0])) if isinstance(parts[1], Tree) else UNKNOWN
    if kind == "call":
        return _called(str(parts[0]), node, inner)
    if kind == "op_neg":
        return computed(inner(parts[0]), Number(-1.0, is_whole=True), lambda a, b: a * b)
    if kind == "op_not":
        value = inner(parts[0])
        return not value if isinstance(value, bool) else UNKNOWN
    if kind.startswith("op_"):
        return _operation(kind, node, inner)
    return UNKNOWN


def arguments_of(node: Node) -> tuple[list[Node], dict[str, Node]]:
    """Arguments of a call: those by place and those by name."""
    by_place: list[Node] = []
    by_name: dict[str, Node] = {}
    for one in (child for part in node.children if isinstance(part, Tree) for child in part.children):
        if isinstance(one, Tree) and isinstance(one.children[-1], Tree):
            if isinstance(one.children[0], Token):
                by_name[str(one.children[0])] = one.children[-1]
            else:
                by_place.append(one.children[-1])
    return by_place, by_name


def _item(values: Value, index: Value) -> Value:
    if not isinstance(index, Number) or not isinstance(values, (tuple, Pose)):
        return UNKNOWN
    place = int(index.value)
    if isinstance(values, Pose):
        return Number(float(values.place.origin_m[place])) if 0 <= place < 3 else UNKNOWN
    return values[place] if 0 <= place < len(values) else UNKNOWN


def _called(name: str, node: Node, inner: Evaluate) -> Value:
    by_place, by_name = arguments_of(node)
    values = [inner(one) for one in by_place]
    if name in _FUNCTIONS and all(isinstance(value, Number) for value in values):
        try:
            return Number(float(_FUNCTIONS[name](*(value.value for value in values))))
        except (ValueError, TypeError, OverflowError, ZeroDivisionError):
            return UNKNOWN
    poses = [value.place for value in values if isinstance(value, Pose)]
    if len(poses) == len(values) == 2 and name == "pose_trans":
        return Pose(poses[0] @ poses[1])
    if len(poses) == len(values) == 2 and name == "pose_add":
        return Pose(Placement(poses[0].rotation @ poses[1].rotation, poses[0].origin_m + poses[1].origin_m))
    if len(poses) == len(values) == 1 and name == "pose_inv":
        return Pose(inverse_of(poses[0]))
    if name == "get_inverse_kin" and values and isinstance(values[0], Pose):
        near = inner(by_name["qnear"]) if "qnear" in by_name else values[1] if len(values) > 1 else None
        return Pose(values[0].place, None if near is None else six_numbers(near))
    if name == "norm" and len(values) == 1 and isinstance(values[0], Number):
        return Number(abs(values[0].value))
    return UNKNOWN


def _operation(kind: str, node: Node, inner: Evaluate) -> Value:
    first, second = inner(node.children[0]), inner(node.children[-1])
    if kind == "op_compare":
        sign = str(node.children[1])
        if isinstance(first, Number) and isinstance(second, Number):
            return _COMPARISONS[sign](first.value, second.value)
        if isinstance(first, (bool, str)) and type(first) is type(second) and sign in ("==", "!="):
            return (first == second) == (sign == "==")
        return UNKNOWN
    if kind in ("op_and", "op_or", "op_xor"):
        return logic(kind, first, second)
    rules: dict[str, Callable[[float, float], float]] = {
        "op_add": lambda a, b: a + b,
        "op_sub": lambda a, b: a - b,
        "op_mul": lambda a, b: a * b,
        "op_div": lambda a, b: a / b,
        "op_mod": math.fmod,
    }
    rule = rules[kind]
    if isinstance(first, tuple) and isinstance(second, tuple) and len(first) == len(second):
        return tuple(computed(a, b, rule) for a, b in zip(first, second, strict=True))
    if isinstance(first, tuple) and isinstance(second, Number) and kind in ("op_mul", "op_div"):
        return tuple(computed(a, second, rule) for a in first)
    return computed(first, second, rule)
