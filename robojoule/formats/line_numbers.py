"""Lines of what errors name by its place in a YAML or JSON file."""

from __future__ import annotations

import re
from collections.abc import Iterator

import yaml

from robojoule.errors import InputError, each_of

_MOST_CHARACTERS = 4 * 2**20  # finding a place reads the text once more
_NAMED = re.compile(r"(?:robot|activity) (?P<name>.*?)(?:, movement (?P<movement>.*))?")


def with_lines(error: InputError, text: str) -> list[InputError]:
    """The findings of an error with the line of each.

    Args:
        error: Its keys are places such as `robots.0.speed`, or names as in `activity fetch, movement m`.
        text: What stands in its file.

    Returns:
        Each finding; as it was where its place is not found.
    """
    try:
        root = yaml.compose(text, Loader=yaml.CSafeLoader) if len(text) <= _MOST_CHARACTERS else None
    except (yaml.YAMLError, RecursionError):  # JSON that is not YAML
        root = None
    return [_with_line(one, root) for one in each_of(error)]


def _with_line(error: InputError, root: yaml.Node | None) -> InputError:
    if type(error) is not InputError or error.key is None or root is None:
        return error
    named = _NAMED.fullmatch(error.key)
    node = _named(root, named["name"], named["movement"]) if named else _at(root, error.key)
    if node is None:
        return error
    key = f"line {node.start_mark.line + 1}, {error.key}"
    return InputError(error.problem, file=error.file, key=key, allowed=error.allowed)


def _at(node: yaml.Node, key: str) -> yaml.Node | None:
    """The key or the entry at a place, or what is nearest around it; none where nothing of the place is there."""
    found: yaml.Node | None = None
    for part in key.split("."):
        if isinstance(node, yaml.MappingNode):
            pair = next((pair for pair in node.value if pair[0].value == part), None)
            if pair is None:
                return found
            found, node = pair
        elif isinstance(node, yaml.SequenceNode) and part.isdecimal() and int(part) < len(node.value):
            found = node = node.value[int(part)]
        else:
            return found
    return found


def _named(root: yaml.Node, name: str, within: str | None) -> yaml.Node | None:
    """The mapping with a name, or one with a second name in it."""
    found = next((node for node in _mappings(root) if _name(node) == name), None)
    if found is None or within is None:
        return found
    return next((node for node in _mappings(found) if node is not found and _name(node) == within), found)


def _mappings(node: yaml.Node) -> Iterator[yaml.MappingNode]:
    """All mappings of lists and of keys, each before those in it."""
    pending = [node]
    seen: set[int] = set()  # aliases repeat nodes
    while pending:
        node = pending.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        if isinstance(node, yaml.MappingNode):
            yield node
            pending += [value for _, value in reversed(node.value)]
        elif isinstance(node, yaml.SequenceNode):
            pending += reversed(node.value)


def _name(node: yaml.MappingNode) -> str | None:
    return next((value.value for key, value in node.value if key.value == "name" and value.value != ""), None)
