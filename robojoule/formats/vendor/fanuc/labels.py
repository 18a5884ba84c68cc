"""Labels of teach pendant programs, and the jumps to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lark import Token

from robojoule.formats.vendor.fanuc.syntax import Block, Instruction, within


def label_of(one: Instruction) -> str:
    """The label that an instruction names."""
    assert one.tree is not None
    return plain_label(str(one.tree.children[-1]))


def plain_label(text: str) -> str:
    """A label without its comment, such as LBL[3]."""
    return text.split(":")[0].rstrip("]").upper() + "]"


def labels_in(one: Instruction) -> list[str]:
    """All labels that an instruction names."""
    if one.tree is None:
        return []
    tokens = one.tree.scan_values(lambda value: isinstance(value, Token) and value.type == "LABEL")
    return [plain_label(str(token)) for token in tokens]


def endless_labels(body: Sequence[Instruction | Block], labels: Mapping[str, int]) -> set[int]:
    """Labels to which the program always comes back: one pass from there is its cycle."""
    return {
        labels[label_of(one)]
        for at, one in enumerate(body)
        if isinstance(one, Instruction) and one.kind == "jump" and labels.get(label_of(one), at) < at
    }


def repeated_labels(body: Sequence[Instruction | Block], labels: Mapping[str, int]) -> set[int]:
    """Labels to which the program may come back after motions."""
    found = set()
    for at, one in enumerate(body):
        for inner in within([one]):
            if inner.kind == "label" or (inner is one and one.kind == "jump"):
                continue
            for label in labels_in(inner):
                target = labels.get(label)
                if target is not None and target <= at and any(x.kind == "motion" for x in within(body[target:at])):
                    found.add(target)
    return found


def inside(reference: str) -> str:
    """The number between the brackets of P[3:name], or the register there."""
    inside = reference[reference.index("[") + 1 : -1].strip()
    if inside[:2].upper() == "R[" and "]" in inside:
        return inside[: inside.index("]") + 1]
    return inside.split(":")[0].split(",")[0].strip()
