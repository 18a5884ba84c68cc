"""Sections of a cycle: what lies between waits and motions of which nobody knows how long they take."""

from __future__ import annotations

from robojoule.programs.operation_tree import AtomicOperation, MoveOperation, OperationTree, UnknownOperation


def unknown_operations(tree: OperationTree) -> tuple[UnknownOperation, ...]:
    """Operations of which nobody knows how long they take, in order of execution."""
    return tuple(one for one in tree.atomic() if isinstance(one, UnknownOperation))


def sections_of(tree: OperationTree) -> tuple[OperationTree, ...]:
    """The parts of a tree between its unknown operations, each a tree with the moves' own names.

    Parts that move nothing are left out. A tree without unknown operations is its own only section.
    """
    if not unknown_operations(tree):
        return (tree,)
    start, position = tree.start_rad, tree.start_rad
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
            start, parts = position, []
            continue
        parts.append(operation)
        if isinstance(operation, MoveOperation):
            position = operation.target_rad
    close()
    return tuple(found)
