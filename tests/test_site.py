"""The documentation as a site: it builds without a warning, loads nothing from elsewhere, and holds every command."""

import os
import re
import sys
from pathlib import Path

import pytest

import robojoule
from robojoule.cli import COMMANDS
from tests.conftest import ROOT, run


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    os.environ["NO_MKDOCS_2_WARNING"] = "1"
    said = run(sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder), cwd=ROOT)
    assert "WARNING" not in said.stdout + said.stderr
    return folder


def test_every_page_loads_what_is_beside_it_only(site):
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 20
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert not re.search(
            r"""<(?:script|img|iframe)[^>]*src="https?:|<link[^>]*rel="stylesheet"[^>]*href="https?:""", text
        )


def test_the_reference_holds_every_command_and_every_name(site):
    commands = (site / "reference/commands.html").read_text(encoding="utf-8")
    library = (site / "reference/library.html").read_text(encoding="utf-8")
    for name in COMMANDS:
        assert f"usage: robojoule {name} " in commands
    for name in robojoule.__all__:
        assert re.search(rf'id="robojoule\.[\w.]*\b{name}"', library), name
