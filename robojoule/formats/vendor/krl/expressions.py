"""Expressions of KRL as far as constants reach."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from lark import Token, Tree

from robojoule.formats.vendor.krl.geometry import joined
from robojoule.formats.vendor.lines import Line, Node
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, computed, logic

_MOST_DEPTH = 60
FUNCTIONS: dict[str, Callable[[float], float]] = {
    "ABS": abs,
    "SQRT": math.sqrt,
    "SIN": lambda x: math.sin(math.radians(x)),
    "COS": lambda x: math.cos(math.radians(x)),
    "TAN": lambda x: math.tan(math.radians(x)),
    "ACOS": lambda x: math.degrees(math.acos(x)),
}
_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "==": lambda a, b: a == b,
    "<>": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
}


class Variables:
    """Values of variables by their names in capitals; structures are mappings of their fields."""

    def __init__(self) -> None:
        self.values: dict[str, Value] = {}
        self.changing: set[str] = set()  # names whose values may change at any time
        self.returned: dict[int, Value] = {}  # what calls of the file's own functions have returned, by their nodes

    def get(self, path: tuple[str, ...] | None) -> Value:
        """A variable or a field of one."""
        if path is None:
            return UNKNOWN
        if path[0].partition("[")[0] in self.changing:
            return UNKNOWN
        value = self.values.get(path[0], UNKNOWN)
        for name in path[1:]:
            value = value.get(name, UNKNOWN) if isinstance(value, Mapping) else UNKNOWN
        return value

    def set(self, path: tuple[str, ...], value: Value) -> None:
        """Assign to a variable or to a field of one."""
        if len(path) == 1:
            self.values[path[0]] = value
            return
        fields = self.values.get(path[0])
        changed = dict(fields) if isinstance(fields, Mapping) else {}
        self.values[path[0]] = changed
        for name in path[1:-1]:
            inner = changed.get(name)
            changed[name] = dict(inner) if isinstance(inner, Mapping) else {}
            changed = changed[name]
        changed[path[-1]] = value

    def forget(self, root: str) -> None:
        """A variable, with all of its elements, is not known any more."""
        for name in [one for one in self.values if one == root or one.startswith(f"{root}[")]:
            self.values[name] = UNKNOWN


def path_of(node: Node, line: Line, variables: Variables, depth: int = 0) -> tuple[str, ...] | None:
    """The parts of a reference in capitals, elements of arrays as in "A[2]"; None: an index is not known."""
    parts: list[str] = []
    for child in node.children:
        if isinstance(child, Token):
            if child.type == "NAME":
                parts.append(str(child).upper())
            continue
        indices = [value_of(one, line, variables, depth) for one in child.children if isinstance(one, Tree)]
        if not indices:  # A[] is the whole of it
            continue
        if not all(isinstance(index, Number) for index in indices):
            return None
        parts[-1] += "[" + ",".join(f"{index.value:g}" for index in indices) + "]"
    return tuple(parts)


def root_of(node: Node) -> str:
    """The name of the variable that a reference begins with."""
    return str(node.children[0]).upper()


def value_of(node: Node | Token, line: Line, variables: Variables, depth: int = 0) -> Value:
    """The value of an expression; `UNKNOWN` where constants do not reach."""
    if isinstance(node, Token) or depth > _MOST_DEPTH:
        return UNKNOWN

    def inner(one: Node | Token) -> Value:
        return value_of(one, line, variables, depth + 1)

    kind, parts = str(node.data), node.children
    if kind == "number":
        text = str(parts[0])
        return Number(float(text), line.span(parts[0]), text.isdigit())
    if kind == "ref":
        return variables.get(path_of(node, line, variables, depth + 1))
    if kind == "aggregate":
        pairs = [one for one in parts if isinstance(one, Tree)]
        return {str(one.children[0]).upper(): inner(one.children[-1]) for one in pairs}
    if kind == "bits":
        text = str(parts[0]).strip("'")
        return Number(float(int(text[1:], 2 if text[0] in "Bb" else 16)), None, True) if _is_bits(text) else UNKNOWN
    if kind in ("string", "enum"):
        return str(parts[0]).upper() if kind == "enum" else str(parts[0])[1:-1]
    if kind in ("true", "false"):
        return kind == "true"
    if kind == "call":
        if id(node) in variables.returned:
            return variables.returned[id(node)]
        return _called(str(parts[0]).upper(), [inner(one) for one in arguments_of(node)])
    if kind == "op_neg":
        value = inner(parts[0])
        return computed(value, Number(-1.0, is_whole=True), lambda a, b: a * b)
    if kind == "op_not":
        value = inner(parts[0])
        return not value if isinstance(value, bool) else UNKNOWN
    if kind.startswith("op_"):
        return _operation(kind, node, inner)
    return UNKNOWN


def _is_bits(text: str) -> bool:
    return text[0] in "Hh" or set(text[1:]) <= set("01")


def arguments_of(node: Node) -> list[Node]:
    """Arguments of a call; those that are left out are nodes of their own kind."""
    (found,) = [one for one in node.children if isinstance(one, Tree)]
    return [one for one in found.children if isinstance(one, Tree)]


def _called(name: str, values: list[Value]) -> Value:
    rule = FUNCTIONS.get(name)
    if rule is None or len(values) != 1:
        return UNKNOWN
    return computed(values[0], Number(0.0), lambda a, _: rule(a))


def _operation(kind: str, node: Node, inner: Callable[[Node | Token], Value]) -> Value:
    first, second = inner(node.children[0]), inner(node.children[-1])
    if kind == "op_add":
        return computed(first, second, lambda a, b: a + b)
    if kind == "op_sub":
        return computed(first, second, lambda a, b: a - b)
    if kind == "op_mul":
        return computed(first, second, lambda a, b: a * b)
    if kind == "op_div":
        both = isinstance(first, Number) and isinstance(second, Number) and first.is_whole and second.is_whole
        return computed(first, second, lambda a, b: float(int(a / b)) if both else a / b)
    if kind == "op_join":
        return joined(first, second) or UNKNOWN
    if kind == "op_compare":
        if isinstance(first, Number) and isinstance(second, Number):
            return _COMPARISONS[str(node.children[1])](first.value, second.value)
        same = isinstance(first, (bool, str)) and type(first) is type(second)
        return (first == second) == (str(node.children[1]) == "==") if same else UNKNOWN
    return logic(kind, first, second)
