"""What the texts say holds: snippets run, links lead somewhere, the schedule works as described."""

import re
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pytest
from pyarrow import csv

from tests.calibration.plant import Plant, make_log
from tests.conftest import ROOT, Background, answers, free_port, run, wait_for
from tests.robots.test_urdf import TWO_JOINTS
from tests.servers import ask

DOCUMENTS = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]
# docs/operation-tree.md has a test of its own, which makes the files that its snippets read.
WITH_SNIPPETS = [path for path in DOCUMENTS if path.name != "operation-tree.md"]


@dataclass(frozen=True)
class Snippet:
    """A fenced block: the words after the fence and the lines inside."""

    language: str
    text: str

    @property
    def commands(self) -> list[str]:
        return [line.removeprefix("$ ") for line in self.text.splitlines() if line.startswith("$ ")]


def snippets(path: Path, *languages: str) -> list[Snippet]:
    blocks = re.findall(r"^```([a-z][a-z -]*)\n(.*?)^```$", path.read_text(encoding="utf-8"), re.M | re.S)
    return [Snippet(language.strip(), text) for language, text in blocks if language.strip() in languages]


def anchors(path: Path) -> set[str]:
    """Names by which links reach the headings of a page."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(path: Path):
    """To a file that is there, and to a heading of it where one is named."""
    for target in re.findall(r"\]\(([^)\s]+)\)", path.read_text(encoding="utf-8")):
        if not target.startswith(("http://", "https://")):
            name, _, heading = target.partition("#")
            file = path.parent / name if name else path
            assert file.exists(), f"{path.name} links to {target}"
            assert not heading or heading in anchors(file), f"{path.name} links to {target}"


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_every_block_has_a_known_language(path: Path):
    """Else a snippet would go untested by a slip of the fence."""
    fences = re.findall(r"^```(\S.*)$", path.read_text(encoding="utf-8"), re.M)
    plain = {"sh", "console", "csv", "python", "yaml", "text"}
    special = {"console mlflow", "console serve", "python door", "yaml operation-tree"}
    assert set(fences) <= plain | special


def test_shell_blocks_hold_the_make_commands_only():
    """Blocks in `sh` are not executed: they would set up an environment inside the tests."""
    for path in WITH_SNIPPETS:
        for snippet in snippets(path, "sh"):
            assert all(line.startswith(("make repro", "make test")) for line in snippet.text.splitlines())


def test_snippets_run(reproduced: Path, prefect_server: str):
    """Every command and every Python block once, in the order of the documents.

    What they read and do not make themselves is a log, `log.csv`, and an arm, `arm.urdf`.
    """
    columns, _ = make_log(Plant(21), 21, motions=20)
    csv.write_csv(pa.table(columns), reproduced / "log.csv")
    (reproduced / "arm.urdf").write_text(TWO_JOINTS, encoding="utf-8")
    done: set[str] = set()
    for path in WITH_SNIPPETS:
        for snippet in snippets(path, "console", "python", "python door"):
            for command in snippet.commands if snippet.language == "console" else [snippet.text]:
                if command not in done:
                    done.add(command)
                    run(
                        *(("bash", "-c") if snippet.language == "console" else ("python", "-c")),
                        command,
                        cwd=reproduced,
                    )


def test_the_mlflow_page_opens(
    reproduced: Path, background: Background, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    port = free_port()
    monkeypatch.setenv("MLFLOW_PORT", str(port))
    (snippet,) = snippets(ROOT / "docs/running.md", "console mlflow")
    background.start(snippet.commands[0].removesuffix("&"), reproduced, tmp_path / "mlflow.log")
    wait_for("MLflow page", lambda: answers(f"http://127.0.0.1:{port}/health"), 90)
    assert answers(f"http://127.0.0.1:{port}/")
    found = ask(f"http://127.0.0.1:{port}/api/2.0/mlflow", "experiments/search", {"max_results": 10})
    assert found["experiments"]
