"""Modules, names and files that documents and docstrings mention exist, and texts are plain English."""

import ast
import re
import subprocess
from functools import cache
from pathlib import Path

import pytest

from tests.imports import PACKAGES, ROOT, file_of, module_name, python_files

DOTTED = re.compile(rf"\b((?:{'|'.join(PACKAGES)})(?:\.[A-Za-z_]\w*)+)")
CODE_MARK = re.compile(r"`+([^`\n]+)`+")
PATH = re.compile(rf"^((?:{'|'.join((*PACKAGES, 'tests', 'docs', 'studies'))})/[\w./-]+)$")
# "Ours" leaves open whose; "is no mass" is not English, while "there is no mass" is; nor is "one of both".
UNWANTED = re.compile(
    r"\b(?:(?<!--)ours|our|we)\b|(?<!here )\b(?:is|are) no |\bone a (?:joint|motion|method|row)\b|one of both", re.I
)
NOT_OF_THE_HOUSE = (
    "CHANGELOG",
    "LICENSE",
    "uv.lock",
    "data/",
    "reports/",
    "studies/tables/",
    "tests/test_names_in_texts.py",
)
MADE = ("studies/data/",)  # files that stages make and git does not keep


def documents() -> list[Path]:
    found = [*ROOT.glob("*.md"), *(ROOT / "data").glob("*.md"), *(ROOT / "models").glob("*.md")]
    found += [*(ROOT / "docs").rglob("*.md"), *(ROOT / "reproduction").rglob("*.md")]
    return sorted(path for path in found if "CHANGELOG" not in path.name)  # it may name what is gone


@cache
def names_of(path: Path) -> frozenset[str]:
    """Names that a module defines or imports at its top, and the members of its classes."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.add(node.id)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found.update((alias.asname or alias.name).split(".")[0] for alias in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and path.name == "__init__.py":
            found.add(node.value)  # names that a package gives out by a table
    return frozenset(found)


def exists(name: str) -> bool:
    """Whether a dotted name is a module, a package, or a name in one."""
    path = file_of(name)
    if path is None:
        return False
    rest = name.removeprefix(module_name(path)).strip(".")
    return not rest or all(part in names_of(path) for part in rest.split("."))


def docstrings(path: Path) -> str:
    kinds = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return "\n".join(ast.get_docstring(node) or "" for node in nodes if isinstance(node, kinds))


def unknown_names(text: str) -> list[str]:
    marks = [mark for mark in CODE_MARK.findall(text) if "NAME" not in mark]
    names = [name for mark in marks for name in DOTTED.findall(mark)]
    files = [match[1] for mark in marks if (match := PATH.match(mark)) and not mark.startswith(MADE)]
    return [name for name in names if not exists(name)] + [file for file in files if not (ROOT / file).exists()]


@pytest.mark.parametrize("path", documents(), ids=lambda path: str(path.relative_to(ROOT)))
def test_what_documents_mention_exists(path: Path):
    text = path.read_text(encoding="utf-8")
    commands = [name for name in re.findall(r"python -m ([\w.]+)", text) if name.split(".")[0] in PACKAGES]
    assert unknown_names(text) + [name for name in commands if not exists(name) and "NAME" not in name] == []


@pytest.mark.parametrize("path", python_files(*PACKAGES, "tests"), ids=module_name)
def test_what_docstrings_mention_exists(path: Path):
    assert unknown_names(docstrings(path)) == []


def test_names_that_do_not_exist_are_found():
    text = "`robojoule.robots.robot.Robot` `robojoule.nowhere` `python -m reproduction.trees.nothing` `docs/none.md`"
    assert unknown_names(text) == ["robojoule.nowhere", "reproduction.trees.nothing", "docs/none.md"]


def test_texts_are_plain_english():
    listed = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    kinds = {".py", ".md", ".sql", ".j2", ".yaml", ".yml", ".toml", ".json", ".cff", ""}
    files = [name for name in listed if Path(name).suffix in kinds and not name.startswith(NOT_OF_THE_HOUSE)]
    lines = [(name, line) for name in files for line in (ROOT / name).read_text(encoding="utf-8").splitlines()]
    assert len(files) > 300
    assert [f"{name}: {line.strip()}" for name, line in lines if UNWANTED.search(line)] == []


@pytest.mark.parametrize("text", ["ours", "Our data", "'x' is no vertex", "Allowed: one of both", "one a joint"])
def test_unwanted_words_are_found(text: str):
    assert UNWANTED.search(text)
    assert not UNWANTED.search("There is no such file, which is not one hour of four")
