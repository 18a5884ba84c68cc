"""What the texts say holds: snippets run, links lead somewhere, the schedule works as described."""

import re
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.conftest import ROOT, Background, answers, free_port, run, wait_for
from tests.flows.test_pipeline import artifacts, post

DOCUMENTS = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
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


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda p: p.name)
def test_links_lead_somewhere(path: Path):
    text = path.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if not target.startswith(("http://", "https://", "#")):
            assert (path.parent / target.split("#")[0]).exists(), f"{path.name} links to {target}"


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda p: p.name)
def test_every_block_has_a_known_language(path: Path):
    """Else a snippet would go untested by a slip of the fence."""
    fences = re.findall(r"^```(\S.*)$", path.read_text(encoding="utf-8"), re.M)
    known = {"sh", "console", "console schedule", "console mlflow", "python", "yaml", "yaml operation-tree", "text"}
    assert set(fences) <= known


def test_shell_blocks_hold_the_make_commands_only():
    """Blocks in `sh` are not executed: they would set up an environment inside the tests."""
    for path in WITH_SNIPPETS:
        for snippet in snippets(path, "sh"):
            assert all(line.startswith(("make repro", "make test")) for line in snippet.text.splitlines())


@pytest.mark.parametrize("path", WITH_SNIPPETS, ids=lambda p: p.name)
def test_snippets_run(path: Path, reproduced: Path, prefect_server: str):
    for snippet in snippets(path, "console", "python"):
        if snippet.language == "python":
            run("python", "-c", snippet.text, cwd=reproduced)
        for command in snippet.commands if snippet.language == "console" else []:
            run("bash", "-c", command, cwd=reproduced)


def test_the_schedule_works_as_described(
    reproduced: Path, prefect_server: str, background: Background, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """The commands of docs/running.md, the server being up: a scheduled run completes and leaves its artifacts."""
    monkeypatch.setenv("PREFECT_WORKER_QUERY_SECONDS", "3")
    commands = [c for s in snippets(ROOT / "docs/running.md", "console schedule") for c in s.commands]
    assert commands[:2] == [
        "export PREFECT_API_URL=http://127.0.0.1:4200/api",
        "prefect server start --host 127.0.0.1 &",
    ]
    for number, command in enumerate(commands[2:]):
        if command.endswith("&"):
            background.start(command.removesuffix("&"), reproduced, tmp_path / f"{number}.log")
        else:
            run("bash", "-c", command.replace("--interval 60", "--interval 15"), cwd=reproduced)

    completed = {"flow_runs": {"state": {"type": {"any_": ["COMPLETED"]}}}}

    def scheduled_and_completed() -> list[dict]:
        return [found for found in post(prefect_server, "flow_runs/filter", completed) if found["auto_scheduled"]]

    wait_for("completed scheduled run", lambda: bool(scheduled_and_completed()), 120)
    run_id = scheduled_and_completed()[0]["id"]
    for key in ("stages", "table-6-1", "training-runs"):
        assert run_id in {found["flow_run_id"] for found in artifacts(prefect_server, key)}
    assert "/runs/" in artifacts(prefect_server, "training-runs")[0]["data"]


def test_the_mlflow_page_opens(
    reproduced: Path, background: Background, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    port = free_port()
    monkeypatch.setenv("MLFLOW_PORT", str(port))
    (snippet,) = snippets(ROOT / "docs/running.md", "console mlflow")
    background.start(snippet.commands[0].removesuffix("&"), reproduced, tmp_path / "mlflow.log")
    wait_for("MLflow page", lambda: answers(f"http://127.0.0.1:{port}/health"), 90)
    assert answers(f"http://127.0.0.1:{port}/")
    found = post(f"http://127.0.0.1:{port}/api/2.0/mlflow", "experiments/search", {"max_results": 10})
    assert found["experiments"]
