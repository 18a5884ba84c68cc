"""Sections of a cycle: what lies between waits and motions of which nobody knows how long they take."""

from __future__ import annotations

from robojoule.programs.operation_tree import (
    AtomicOperation,
    MoveOperation,
    OperationTree,
    PayloadOperation,
    UnknownOperation,
)


def unknown_operations(tree: OperationTree) -> tuple[UnknownOperation, ...]:
    """Operations of which nobody knows how long they take, in order of execution."""
    return tuple(one for one in tree.atomic() if isinstance(one, UnknownOperation))


def sections_of(tree: OperationTree) -> tuple[OperationTree, ...]:
    """The parts of a tree between its unknown operations, each a tree with the moves' own names.

    Parts that move nothing are left out. A tree without unknown operations is its own only section. A section begins
    with the payload that the one before it ends with. Moves of a speed group that several sections share keep their
    speed.
    """
    if not unknown_operations(tree):
        return (tree,)
    start, position = tree.start_rad, tree.start_rad
    shared = shared_groups(tree)
    carried: tuple[AtomicOperation, ...] = ()
    parts: list[AtomicOperation] = []
    found: list[OperationTree] = []

    def close() -> None:
        if any(isinstance(part, MoveOperation) and part.target_rad != start for part in parts):
            changes = {"name": f"{tree.name}-{len(found) + 1}", "start_rad": start, "operations": tuple(parts)}
            found.append(tree.model_copy(update=changes))

    for operation in tree.atomic():
        if isinstance(operation, UnknownOperation):
            close()
            position = operation.target_rad if operation.target_rad is not None else position
            start, parts = position, [*carried]
            continue
        if isinstance(operation, PayloadOperation):
            carried = (operation,)
        if isinstance(operation, MoveOperation) and operation.speed_group in shared:
            operation = operation.model_copy(update={"speed_group": None, "fixed": True})
        parts.append(operation)
        if isinstance(operation, MoveOperation):
            position = operation.target_rad
    close()
    return tuple(found)


def shared_groups(tree: OperationTree) -> set[str]:
    """Speed groups with moves in several sections; these keep their speed."""
    section, places = 0, dict[str, set[int]]()
    for operation in tree.atomic():
        if isinstance(operation, UnknownOperation):
            section += 1
        elif isinstance(operation, MoveOperation) and operation.speed_group is not None:
            places.setdefault(operation.speed_group, set()).add(section)
    return {name for name, sections in places.items() if len(sections) > 1}
