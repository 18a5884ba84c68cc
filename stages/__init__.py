"""The DVC stages: thin shells around the rooms of `reproduction`, one module per stage; those of the studies too.

What a stage writes must not depend on the machine, so it computes with one thread per process, as its products are
small, and with the vector instructions that all processors with AVX2 have: wider ones, or other kernels of linear
algebra, add in another order. This is said here, in variables for this process and those that it starts, because
libraries ask once, when they are loaded.
"""

import os
import platform
from pathlib import Path

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_AVX2 = {
    "OPENBLAS_CORETYPE": "Haswell",  # in numpy and in SciPy; a processor without AVX2 would end with a signal
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "ARROW_USER_SIMD_LEVEL": "AVX2",
}


def has_avx2(machine: str, processors: Path) -> bool:
    """Whether this is Linux on an x86-64 processor with AVX2, which brings fused multiplication and addition.

    Args:
        machine: Kind of machine.
        processors: File in which Linux describes them.
    """
    if machine != "x86_64" or not processors.is_file():
        return False
    lines = processors.read_text(encoding="utf-8", errors="replace").splitlines()
    return {"avx2", "fma"} <= set(next((line for line in lines if line.startswith("flags")), "").split())


SAME_BYTES = has_avx2(platform.machine(), Path("/proc/cpuinfo"))
"""Whether this machine gives the bytes that are committed."""

os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
if SAME_BYTES:
    os.environ.pop("NPY_ENABLE_CPU_FEATURES", None)  # numpy takes one of the two
    os.environ.update(_AVX2)
