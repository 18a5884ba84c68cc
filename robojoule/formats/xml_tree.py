"""XML read safely: elements with the line on which they begin; document types, and with them entities, are refused."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar
from xml.parsers import expat

from robojoule.documents import MOST_BYTES, read_bytes
from robojoule.errors import InputError
from robojoule.inputs import number_of, shown

_DEEPEST = 32
_MOST_ELEMENTS = 2_000_000
N = TypeVar("N", int, float)


@dataclass(slots=True)
class Element:
    """An element.

    Attributes:
        file: File that it stands in.
        line: Line on which it begins.
        tag: Its name.
        attributes: Its attributes.
        children: Elements within it, in order.
        text: Text within it.
    """

    file: Path
    line: int
    tag: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def error(self, problem: str, *, allowed: str | None = None, key: str | None = None) -> InputError:
        """An error that names the file and the line."""
        return InputError(
            problem, file=self.file, key=f"line {self.line}" + (f", {key}" if key else ""), allowed=allowed
        )

    def all(self, tag: str) -> Iterator[Element]:
        """The elements of some name right within this one."""
        return (child for child in self.children if child.tag == tag)

    def only(self, *known: str) -> None:
        """Refuse elements of other names."""
        for child in self.children:
            if child.tag not in known:
                raise child.error(f"<{self.tag}> cannot hold <{child.tag}>", allowed=", ".join(known))

    def maybe(self, tag: str) -> Element | None:
        """The one element of some name, if there is one."""
        found = list(self.all(tag))
        if len(found) > 1:
            raise found[1].error(f"<{self.tag}> holds <{tag}> twice")
        return found[0] if found else None

    def one(self, tag: str) -> Element:
        """The one element of some name."""
        found = self.maybe(tag)
        if found is None:
            raise self.error(f"<{self.tag}> lacks <{tag}>")
        return found

    def content(self, tag: str) -> str:
        """Text of the one element of some name; empty without it."""
        found = self.maybe(tag)
        return " ".join(found.text.split()) if found is not None else ""

    def attribute(self, name: str) -> str:
        """An attribute that must be there."""
        if name not in self.attributes:
            raise self.error(f"<{self.tag}> lacks the attribute {name}")
        return self.attributes[name].strip()

    def number(self, name: str | None = None) -> float:
        """The number in an attribute, or in the text."""
        text = self.attribute(name) if name else self.text.strip()
        try:
            return number_of(text)
        except ValueError as error:
            raise self.error(f"{name or f'<{self.tag}>'}: {error}") from None

    def whole(self, name: str | None = None) -> int:
        """The whole number in an attribute, or in the text."""
        value = self.number(name)
        if value != int(value):
            raise self.error(f"{name or f'<{self.tag}>'}: {shown(value)} is not a whole number")
        return int(value)


def read_xml(path: str | Path) -> Element:
    """The root element of a file.

    Raises:
        InputError: The file cannot be read, is not XML, has a document type (entities could stand for other files or
            grow without end), or is too large or too deep.
    """
    path = Path(path)
    content = read_bytes(path, MOST_BYTES)
    parser = expat.ParserCreate()
    parser.buffer_text = True
    open_elements: list[Element] = []
    roots: list[Element] = []
    count = 0

    def refuse(problem: str, allowed: str | None = None) -> InputError:
        return InputError(problem, file=path, key=f"line {parser.CurrentLineNumber}", allowed=allowed)

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        element = Element(path, parser.CurrentLineNumber, tag, attributes)
        if open_elements:
            open_elements[-1].children.append(element)
        else:
            roots.append(element)
        open_elements.append(element)
        if len(open_elements) > _DEEPEST:
            raise refuse(f"elements are nested more than {_DEEPEST} deep")
        if count > _MOST_ELEMENTS:
            raise refuse("the file holds too many elements", f"at most {_MOST_ELEMENTS}")

    def end(_: str) -> None:
        open_elements.pop()

    def text(data: str) -> None:
        if open_elements:
            open_elements[-1].text += data

    def document_type(*_: object) -> None:
        raise refuse("a document type (<!DOCTYPE ...>) is not read, as entities are not", "a file without it")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = text
    parser.StartDoctypeDeclHandler = document_type
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        reason = expat.errors.messages[error.code]
        raise InputError(f"the file is not XML ({reason})", file=path, key=f"line {error.lineno}") from None
    except (LookupError, ValueError):  # an encoding that is not known
        raise InputError("the file names an encoding that is not known", file=path, allowed="UTF-8") from None
    return roots[0]
