"""What all benchmarks share: clocks, interleaved rounds, processes with their memory, the machine."""

from __future__ import annotations

import os
import platform
import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from statistics import median

PACKAGES = ("robojoule", "numpy", "pin", "ruckig", "pyarrow", "pyomo", "highspy", "scikit-learn", "prefect", "dvc")
PAGE_MIB = os.sysconf("SC_PAGE_SIZE") / 2**20


def machine() -> dict[str, object]:
    """Processor, cores and Python of this machine."""
    models = [line for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines() if line.startswith("model name")]
    return {
        "processor": models[0].split(":", 1)[1].strip() if models else platform.machine(),
        "cores": len(os.sched_getaffinity(0)),
        "python": platform.python_version(),
    }


def versions() -> dict[str, str]:
    """Versions of the packages whose speed is measured."""
    return {name: version(name) for name in PACKAGES}


def interleaved(
    rounds: int, clock: Callable[[], float] = time.perf_counter, **works: Callable[[], object]
) -> dict[str, list[float]]:
    """Seconds of each work in each round, one after another in every round, after one round that is not counted."""
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for count in range(rounds + 1):
        for name, work in works.items():
            start = clock()
            work()
            if count:
                seconds[name].append(clock() - start)
    return seconds


def ratio(seconds: Mapping[str, Sequence[float]], of: str, over: str) -> float:
    """Median over the rounds of the quotient of two works."""
    return median(a / b for a, b in zip(seconds[of], seconds[over], strict=True))


@dataclass(frozen=True)
class Finished:
    """A command that ran to its end.

    Attributes:
        seconds: From start to end. [s]
        peak_mib: Largest sum of the resident memory of all its processes, shared pages counted in each. [MiB]
        output: What it printed.
    """

    seconds: float
    peak_mib: float
    output: str


def run(command: Sequence[str], cwd: Path | None = None, watch: bool = False) -> Finished:
    """Run a command; with `watch`, add up the memory of its processes four times a second.

    Raises:
        RuntimeError: It failed.
    """
    start, peaks = time.perf_counter(), [0.0]
    process = subprocess.Popen(
        command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )

    def look() -> None:
        while process.poll() is None:
            peaks.append(session_mib(process.pid))
            time.sleep(0.25)

    if watch:
        threading.Thread(target=look, daemon=True).start()
    output = process.communicate()[0]
    seconds = time.perf_counter() - start
    if process.returncode:
        raise RuntimeError(f"{' '.join(command)} ended with {process.returncode}:\n{output[-4000:]}")
    return Finished(seconds, max(peaks), output)


def session_mib(session: int) -> float:
    """Resident memory of all processes of a session. [MiB]"""
    total = 0
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if int((folder / "stat").read_text().rpartition(")")[2].split()[3]) == session:
                total += int((folder / "statm").read_text().split()[1])
        except (OSError, IndexError):  # it has just ended
            continue
    return total * PAGE_MIB


def rounded(values: Mapping[str, float], digits: int = 4) -> dict[str, float]:
    """Values with a few significant digits."""
    return {name: float(f"{value:.{digits}g}") for name, value in values.items()}
