"""What the project's modules import, read from their source."""

import ast
from collections.abc import Iterable
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("robojoule", "reproduction", "stages", "flows", "benchmarks")


def python_files(*folders: str) -> list[Path]:
    """Modules in folders; the examples are scripts of users, not modules."""
    found = sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))
    return [path for path in found if path.parent != ROOT / "robojoule/examples"]


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def relative(paths: Iterable[Path]) -> set[str]:
    return {path.relative_to(ROOT).as_posix() for path in paths}


@cache
def imports(path: Path) -> tuple[tuple[str, bool], ...]:
    """Imported names of a file: dotted name (module, or module.name) and whether it is imported on loading the file.

    What is under `if TYPE_CHECKING` is not imported.
    """
    found: list[tuple[str, bool]] = []

    def visit(node: ast.AST, top: bool) -> None:
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            return
        if isinstance(node, ast.Import):
            found.extend((alias.name, top) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found.extend((f"{node.module}.{alias.name}", top) for alias in node.names)
        for child in ast.iter_child_nodes(node):
            visit(child, top and not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))

    visit(ast.parse(path.read_text(encoding="utf-8")), True)
    return tuple(found)


@cache
def file_of(name: str) -> Path | None:
    """The project's file behind a dotted name, None for names of other packages."""
    if name.split(".")[0] not in PACKAGES:
        return None
    while name:
        base = ROOT.joinpath(*name.split("."))
        for path in (base.with_suffix(".py"), base / "__init__.py"):
            if path.exists():
                return path
        name = name.rpartition(".")[0]
    return None


def imported_files(path: Path) -> list[Path]:
    """Files of the project that a file imports, and the packages above it."""
    found = [target for name, _ in imports(path) if (target := file_of(name)) and target != path]
    parents = [path.parents[up] / "__init__.py" for up in range(len(path.relative_to(ROOT).parts) - 1)]
    return [*found, *(parent for parent in parents if parent.exists() and parent != path)]


def closure(path: Path, plumbing: Iterable[str] = ()) -> set[Path]:
    """Files that a file reaches by imports, itself included; not those of `plumbing`, nor what only they reach."""
    left_out = set(plumbing)
    seen: set[Path] = set()
    stack = [path]
    while stack:
        current = stack.pop()
        name = current.relative_to(ROOT).as_posix()
        if current not in seen and not any(name == one or name.startswith(f"{one}/") for one in left_out):
            seen.add(current)
            stack.extend(imported_files(current))
    return seen
