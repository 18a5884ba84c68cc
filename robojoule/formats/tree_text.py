"""Plans written into the text of an operation tree's file: numbers change, comments, units and order stay.

YAML says where each key and each value begin and end; JSON is read as YAML for that. A number that differs is replaced
in its place, one that has no place yet is added to its move.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import yaml

from robojoule.programs.operation_tree import PLANNED, MoveOperation, OperationTree

_REMARK = "# robojoule: "
_ESCAPE = re.compile(r"\\(?:u[0-9a-fA-F]{4}|.)")
_LINE_END = re.compile(r"[\r\n]")
_ALIAS = re.compile(r"\s*:\s*(\*[^\s,\]}]+)")


@dataclass(frozen=True)
class _Edit:
    """What stands from one character to another, and what shall stand there."""

    start: int
    end: int
    text: str


def text_with_plan(text: str, tree: OperationTree) -> str | None:
    """The text of a file of a tree with the speed limits and waits of another tree of the same operations.

    Args:
        text: YAML or JSON.
        tree: The tree that it shall hold.

    Returns:
        The text; None where that cannot be said in the text as it stands. What it holds is for the caller to check.
    """
    try:
        root = yaml.compose(_readable(text), Loader=yaml.CSafeLoader)
    except (yaml.YAMLError, RecursionError):
        return None
    found, moves = list(_moves(root)), tree.moves()
    if len(found) != len(moves) or not isinstance(root, yaml.MappingNode):
        return None
    edits = [edit for node, move in zip(found, moves, strict=True) for edit in _edits(text, node, move)]
    edits += [*_angle_edits(text, root, tree), *_cycle_edits(text, root, tree)]
    for edit in sorted(edits, key=lambda one: one.start, reverse=True):
        text = text[: edit.start] + edit.text + text[edit.end :]
    return text


def text_with_remarks(text: str, remarks: Sequence[str]) -> str:
    """The text of a YAML file with comments on its plan at the top, in place of those of an earlier plan."""
    lines = [line for line in text.splitlines(keepends=True) if not line.startswith(_REMARK)]
    end = _line_end(text)
    return "".join([*(f"{_REMARK}{remark}{end}" for remark in remarks), *lines])


def _readable(text: str) -> str:
    r"""JSON as YAML with every value in the same place; other texts as they are.

    Between values JSON has tabs where YAML has none, within strings halves of characters (`\ud83d`).
    """
    if not text.lstrip().startswith("{"):
        return text
    return _ESCAPE.sub(lambda found: "x" * 6 if len(found[0]) == 6 else found[0], text.replace("\t", " "))


def number_text(value: float) -> str:
    """A number as it is written: whole ones without a point, others so that YAML, too, takes them for numbers."""
    if value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    digits, exponent, power = repr(value).partition("e")
    return f"{digits}{'' if '.' in digits or not exponent else '.0'}{exponent}{power}"


def _moves(node: yaml.Node | None) -> Iterator[yaml.MappingNode]:
    """Mappings of moves in the order of the text."""
    operations = _entries(node).get("operations") if isinstance(node, yaml.MappingNode) else None
    if operations is None or not isinstance(operations[1], yaml.SequenceNode):
        return
    for operation in operations[1].value:
        kind = _entries(operation).get("type") if isinstance(operation, yaml.MappingNode) else None
        if kind is not None and kind[1].value == "move":
            yield operation
        yield from _moves(operation)


def _entries(node: yaml.MappingNode) -> dict[str, tuple[yaml.Node, yaml.Node]]:
    return {key.value: (key, value) for key, value in node.value if isinstance(key, yaml.ScalarNode)}


def _edits(text: str, node: yaml.MappingNode, move: MoveOperation) -> Iterator[_Edit]:
    """What has to change in one move's text."""
    entries = _entries(node)
    new = {}
    for name, default in PLANNED.items():
        wanted = getattr(move, name)
        if name not in entries:
            if wanted != default:
                new[name] = number_text(wanted)
            continue
        if wanted is not None and not _reads_as(entries[name][1].value, wanted):
            yield _Edit(*_span(text, *entries[name]), number_text(wanted))
    if new:
        yield _added(text, node, new)


def _angle_edits(text: str, root: yaml.MappingNode, tree: OperationTree) -> Iterator[_Edit]:
    """What has to change so that the text says how its angles count."""
    entry = _entries(root).get("angles")
    if entry is None:
        if tree.angles != OperationTree.model_fields["angles"].default:
            yield _added(text, root, {"angles": tree.angles}, is_text=True)
    elif entry[1].value != tree.angles:
        quote = '"' if text[entry[1].start_mark.index] == '"' else ""
        yield _Edit(*_span(text, *entry), f"{quote}{tree.angles}{quote}")


def _cycle_edits(text: str, root: yaml.MappingNode, tree: OperationTree) -> Iterator[_Edit]:
    """What has to change so that the text says for which cycle time it was planned."""
    entry, wanted = _entries(root).get("planned_cycle_s"), tree.planned_cycle_s
    if wanted is None:
        return  # a plan says it; where there is none, a key that stands there is for the caller to find
    if entry is None:
        yield _added(text, root, {"planned_cycle_s": number_text(wanted)})
    elif not _reads_as(entry[1].value, wanted):
        yield _Edit(*_span(text, *entry), number_text(wanted))


def _span(text: str, key: yaml.Node, value: yaml.Node) -> tuple[int, int]:
    """Where the value of a key begins and ends; a reference to a value elsewhere is one of its own."""
    alias = _ALIAS.match(text, key.end_mark.index)
    return (value.start_mark.index, value.end_mark.index) if alias is None else alias.span(1)


def _reads_as(text: str, wanted: float) -> bool:
    try:
        return float(text.replace("_", "")) == wanted
    except ValueError:
        return False


def _added(text: str, node: yaml.MappingNode, new: dict[str, str], *, is_text: bool = False) -> _Edit:
    """Further entries of a mapping, in its style; values that are text are quoted where keys are."""
    entries = list(_entries(node).values())
    if node.flow_style:
        key, last = entries[-1]
        own_lines = key.start_mark.line != node.start_mark.line
        quote = '"' if text[key.start_mark.index] == '"' else ""
        between = f",{_line_end(text)}{_indent(text, key)}" if own_lines else ", "
        mark = quote if is_text else ""
        said = "".join(f"{between}{quote}{name}{quote}: {mark}{value}{mark}" for name, value in new.items())
        _, end = _span(text, key, last)
        return _Edit(end, end, said)
    # Lists and texts of several lines end somewhere behind their last line: where other values end is sure.
    key, last = [entry for entry in entries if not _is_block(entry[1])][-1]
    line = f"{_line_end(text)}{' ' * key.start_mark.column}"  # the first key may stand behind the dash of a list
    after = _LINE_END.search(text, _span(text, key, last)[1])
    place = after.start() if after else len(text)
    return _Edit(place, place, "".join(f"{line}{name}: {value}" for name, value in new.items()))


def _indent(text: str, key: yaml.Node) -> str:
    """What stands at the beginning of a key's line."""
    line = text[key.start_mark.index - key.start_mark.column : key.start_mark.index]
    return line[: len(line) - len(line.lstrip())]


def _is_block(value: yaml.Node) -> bool:
    if isinstance(value, yaml.ScalarNode):
        return value.style in ("|", ">")
    return isinstance(value, yaml.CollectionNode) and not value.flow_style


def _line_end(text: str) -> str:
    return "\r\n" if "\r\n" in text else "\n"
