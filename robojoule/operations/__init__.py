"""Operation trees: what a robot does in one cycle; files, checks, random generation."""

from robojoule.operations.files import (
    check_tree,
    load_tree,
    operation_tree_schema,
    parse_tree,
    published_schema,
    save_tree,
    tree_to_data,
    write_schema,
)
from robojoule.operations.model import (
    FORMAT,
    FORMAT_VERSION,
    AtomicOperation,
    CoarseZone,
    CompoundOperation,
    MoveOperation,
    Operation,
    OperationTree,
    ProcessOperation,
    WaitOperation,
)

__all__ = [
    "FORMAT",
    "FORMAT_VERSION",
    "AtomicOperation",
    "CoarseZone",
    "CompoundOperation",
    "MoveOperation",
    "Operation",
    "OperationTree",
    "ProcessOperation",
    "WaitOperation",
    "check_tree",
    "load_tree",
    "operation_tree_schema",
    "parse_tree",
    "published_schema",
    "save_tree",
    "tree_to_data",
    "write_schema",
]
