"""Sets of random motions through Prefect: the curve over their number, one worker against two. Part of `make bench`."""

from __future__ import annotations

import re
import sys
from itertools import pairwise
from pathlib import Path
from statistics import median

from benchmarks.measure import Finished, rounded, run

SIZES = (1_000, 10_000)
FULL_SIZE = 100_000
COMPARED = 80_000  # motions with one worker and with two
SHARD_MOTIONS = 10_000


def command(out: Path, motions: int, *options: str) -> Finished:
    """One command `python -m flows.scale`, with the memory of all its processes, the Prefect server's included."""
    words = [sys.executable, "-m", "flows.scale", "--motions", str(motions), "--out", str(out), *options]
    return run(words, watch=True)


def motions_per_s(log: str, shard_motions: int, workers: int) -> float:
    """Rate once all workers are up: from the end of the first shard of each to the end of the last shard. [1/s]"""
    ends = [float(text) for text in re.findall(r"shard \d+: \d+ of \d+ after ([\d.]+) s", log)]
    return (len(ends) - workers) * shard_motions / (ends[-1] - ends[workers - 1])


def curve(folder: Path, sizes: tuple[int, ...]) -> list[dict[str, float]]:
    """Whole commands with two worker processes, from start to manifest."""
    rows = []
    for motions in sizes:
        shard = min(SHARD_MOTIONS, motions // 2)  # work for both workers
        done = command(folder / f"{motions}", motions, "--workers", "2", "--shard-motions", str(shard))
        rows.append(rounded({"motions": motions, "seconds": done.seconds, "peak_mib": done.peak_mib}, 6))
    return rows


def measure(folder: Path, full: bool) -> dict[str, object]:
    """The curve, what a further motion takes along its last decade, and the gain by a second worker."""
    rows = curve(folder, (*SIZES, FULL_SIZE) if full else SIZES)
    rates: dict[int, list[float]] = {1: [], 2: []}
    for attempt in range(2):
        for workers in rates:
            options = ["--workers", str(workers), "--shard-motions", str(SHARD_MOTIONS)]
            log = command(folder / f"{workers}-{attempt}", COMPARED, *options).output
            rates[workers].append(motions_per_s(log, SHARD_MOTIONS, workers))
    one, two = (median(rates[workers]) for workers in rates)
    further = [(b["seconds"] - a["seconds"]) / (b["motions"] - a["motions"]) for a, b in pairwise(rows)]
    return {
        "curve": rows,
        **rounded(
            {
                "two_workers_over_one": two / one,
                "motions_per_s_two_workers": two,
                "ms_a_further_motion": 1e3 * further[-1],
                "memory_last_over_the_one_before": rows[-1]["peak_mib"] / rows[-2]["peak_mib"],
                "peak_mib": max(row["peak_mib"] for row in rows),
            }
        ),
    }
