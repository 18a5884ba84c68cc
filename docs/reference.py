"""Pages of the site that are made from the code: commands from their `--help`, the library from its docstrings."""

from __future__ import annotations

import contextlib
import io
import os
import re
from typing import Any

from mkdocs.structure.files import File, Files

import robojoule
from robojoule.cli import COMMANDS, main

_SUBCOMMANDS = {"robots": ("check", "scale"), "cell": ("solve", "check", "gantt")}


def on_files(files: Files, config: Any) -> Files:
    """Add the pages."""
    for name, text in (("commands", commands()), ("library", library())):
        files.append(File.generated(config, f"reference/{name}.md", content=text))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Name files of the repository that are not pages, where a page links to them."""
    depth = page.file.src_uri.count("/") + 1
    return re.sub(rf"\[([^\]]*)\]\(((?:\.\./){{{depth},}}[^)]*)\)", _named, markdown)


def _named(link: re.Match[str]) -> str:
    path = link[2].replace("../", "")
    return link[1] if path in link[1] else f"{link[1]} (`{path}`)"


def commands() -> str:
    """Every command with its help."""
    words = [(name,) for name in COMMANDS] + [(name, sub) for name, subs in _SUBCOMMANDS.items() for sub in subs]
    parts = [f"## robojoule {' '.join(one)}\n\n```text\n{_help(one)}```\n" for one in sorted(words)]
    return "# Command line\n\nExit codes: 0 done, 1 failed, 2 bad input, 130 interrupted.\n\n" + "\n".join(parts)


def _help(words: tuple[str, ...]) -> str:
    os.environ["COLUMNS"] = "100"
    text = io.StringIO()
    with contextlib.redirect_stdout(text), contextlib.suppress(SystemExit):
        main([*words, "--help"])
    return text.getvalue()


def library() -> str:
    """Every name of the door with its docstring."""
    names = sorted(robojoule.__all__, key=str.lower)
    modules = {name: getattr(robojoule, name).__module__ for name in names}
    lines = [f"::: {modules[name]}.{name}\n" for name in names]
    about = "`import robojoule as rj` has these names; each is loaded when it is first used. Units are SI."
    return f"# Python\n\n{about}\n\n" + "\n".join(lines)
