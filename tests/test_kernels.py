"""The same bytes whatever kernels a processor or a caller would choose: the toy pipeline under each that runs here."""

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import stages
from tests.conftest import ROOT

pytestmark = pytest.mark.skipif(not stages.SAME_BYTES, reason="the committed bytes are those of Linux, x86-64 and AVX2")

# What the environment of a caller may say; kernels of the same name in other generations of processors are one.
CALLERS = {
    "Sandybridge": {
        "OPENBLAS_CORETYPE": "Sandybridge",
        "OPENBLAS_NUM_THREADS": "2",
        "NPY_DISABLE_CPU_FEATURES": "X86_V3",
    },
    "Prescott": {"OPENBLAS_CORETYPE": "Prescott", "ARROW_USER_SIMD_LEVEL": "SSE4_2"},
}
if "avx512bw" in (Path("/proc/cpuinfo").read_text() if stages.SAME_BYTES else "").split():
    CALLERS["SkylakeX"] = {"OPENBLAS_CORETYPE": "SkylakeX", "NPY_ENABLE_CPU_FEATURES": "X86_V3"}
SAY_KERNELS = """
import hashlib, numpy as np, pyarrow, scipy.linalg, threadpoolctl
values = np.random.default_rng(0).normal(size=(64, 64))
kernels = {one["architecture"] for one in threadpoolctl.threadpool_info() if one["user_api"] == "blas"}
print(*kernels, hashlib.md5(np.linalg.inv(values).tobytes()).hexdigest(), pyarrow.runtime_info().simd_level)
"""

# One process for all stages, less the record of the trainings: most of the time of a toy is loading packages.
ALL_STAGES = """
import sys
from importlib import import_module
from pathlib import Path
import stages
from reproduction.config import load_params
from reproduction.layout import Layout

if __name__ == "__main__":
    params, layout = load_params(Path(sys.argv[1]) / "params.yaml"), Layout(Path(sys.argv[1]))
    for name in ("generate_trees", "simulate_motions", "build_features", "train_profile_predictor"):
        getattr(import_module(f"stages.{name}"), name)(params, layout)
    import_module("stages.train_predictors").train_and_compare(params, layout)
    for name in ("evaluate_plans", "draw_figures"):
        getattr(import_module(f"stages.{name}"), name)(params, layout)
"""


def environment(caller: dict[str, str]) -> dict[str, str]:
    """That of a caller: this process has imported the stages and holds their variables."""
    bound = ("OPENBLAS_CORETYPE", "OPENBLAS_NUM_THREADS", "NPY_DISABLE_CPU_FEATURES", "ARROW_USER_SIMD_LEVEL")
    return {**{name: value for name, value in os.environ.items() if name not in bound}, **caller}


def kernels(caller: dict[str, str], before: str = "") -> tuple[str, ...]:
    """Kernels of linear algebra, hash of what they compute, and Arrow's level, in the environment of a caller."""
    words = [sys.executable, "-c", before + SAY_KERNELS]
    done = subprocess.run(words, cwd=ROOT, env=environment(caller), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return tuple(done.stdout.split())


def test_kernels_differ_but_in_stages_and_flows():
    """Else the test below could not fail."""
    free = [kernels(caller) for caller in CALLERS.values()]
    assert len({product for *_, product, _ in free}) == len(CALLERS)
    buildings = ("import stages\n", "import flows\n")
    (bound,) = {kernels(caller, before) for caller in CALLERS.values() for before in buildings}
    assert (bound[0], bound[-1]) == ("Haswell", "avx2")


def hashes(root: Path) -> dict[str, str]:
    """MD5 of every output."""
    files = (path for folder in ("data", "models", "reports") for path in (root / folder).rglob("*") if path.is_file())
    return {
        path.relative_to(root).as_posix(): hashlib.md5(path.read_bytes()).hexdigest()
        for path in files
        if path.name not in (".gitignore", "README.md")
    }


# The oldest and the newest: each takes a whole pipeline, and the test above shows that all are bound alike.
@pytest.mark.parametrize("name", [next(iter(CALLERS)), list(CALLERS)[-1]])
def test_the_pipeline_gives_the_same_bytes(reproduced: Path, tmp_path: Path, name: str):
    shutil.copytree(reproduced / "studies", tmp_path / "studies")
    shutil.copy(reproduced / "params.yaml", tmp_path)
    words = [sys.executable, "-c", ALL_STAGES, str(tmp_path)]
    done = subprocess.run(words, cwd=ROOT, env=environment(CALLERS[name]), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found, expected = hashes(tmp_path), hashes(reproduced)
    assert [name for name in expected if found.get(name) != expected[name]] == []
