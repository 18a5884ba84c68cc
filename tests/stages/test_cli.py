"""The command line that every stage shares."""

import subprocess
import sys
from pathlib import Path

import pytest

import stages
from reproduction.layout import Layout
from robojoule.errors import InputError, PlanningError
from stages.cli import OTHER_BYTES, run, say

ROOT = Path(__file__).parents[2]


def command(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", *words], cwd=ROOT, capture_output=True, text=True, check=False, encoding="utf-8"
    )


@pytest.mark.parametrize(
    ("stage", "file"),
    [("generate_trees", "params.yaml"), ("judge_targets", "studies/params.yaml")],
)
def test_a_missing_parameter_file_is_one_sentence_and_exit_code_2(tmp_path: Path, stage: str, file: str):
    done = command(f"stages.{stage}", "--root", str(tmp_path))
    assert done.returncode == 2
    assert done.stderr == f"{stage}: {tmp_path / file}: there is no such file\n"


def test_another_parameter_file_is_read(tmp_path: Path):
    path = tmp_path / "other.yaml"
    path.write_text("robot: {}\n", encoding="utf-8")
    done = command("stages.build_features", "--root", str(tmp_path), "--params", str(path))
    assert done.returncode == 2 and done.stderr.startswith(f"build_features: {path}, robot.name: ")


@pytest.mark.parametrize(("error", "code"), [(InputError("no tree"), 2), (PlanningError("no plan"), 1)])
def test_errors_end_a_stage_with_their_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture, error: Exception, code: int
):
    def fail(params: str, layout: Layout) -> None:
        assert (params, layout) == (tmp_path / "p.yaml", Layout(tmp_path))
        raise error

    monkeypatch.setattr("sys.argv", ["fail", "--root", str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        run(fail, Path, "p.yaml")
    assert ended.value.code == code
    assert capsys.readouterr().err == f"fail: {error}\n"


def test_progress_names_the_stage(capsys: pytest.CaptureFixture):
    say("draw_figures")("figure_3_1")
    assert capsys.readouterr().out == "draw_figures: figure_3_1\n"


def test_a_stage_computes_with_one_thread():
    code = "import stages.cli, numpy, threadpoolctl; print({p['num_threads'] for p in threadpoolctl.threadpool_info()})"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True).stdout == "{1}\n"


@pytest.mark.parametrize(
    ("machine", "flags", "found"),
    [
        ("x86_64", "fpu avx fma avx2 sha_ni", True),
        ("x86_64", "fpu avx fma avx2 avx512f", True),
        ("x86_64", "fpu avx fma avx2x", False),
        ("x86_64", "fpu avx avx2", False),
        ("x86_64", "", False),
        ("x86_64", None, False),  # another system than Linux
        ("aarch64", "fpu avx fma avx2", False),
    ],
)
def test_a_processor_is_known_by_its_flags(tmp_path: Path, machine: str, flags: str | None, found: bool):
    file = tmp_path / "cpuinfo"
    if flags is not None:
        file.write_text(
            f"processor\t: 0\nvendor_id\t: avx2\nflags\t\t: {flags}\nbugs\t\t: fma avx2\n", encoding="utf-8"
        )
    assert stages.has_avx2(machine, file) == found


@pytest.mark.parametrize("same", [True, False])
def test_a_machine_with_other_bytes_is_told_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture, same: bool
):
    monkeypatch.setattr(stages, "SAME_BYTES", same)
    monkeypatch.setattr("sys.argv", ["build"])

    def build(params: Path, layout: Layout) -> None:
        pass

    run(build, Path)
    assert capsys.readouterr().err == ("" if same else f"build: {OTHER_BYTES}\n")
