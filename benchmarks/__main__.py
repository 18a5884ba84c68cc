"""`python -m benchmarks [--full]`: all benchmarks into benchmarks/results.json and the table of docs/performance.md."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path

from threadpoolctl import threadpool_limits

from benchmarks import commands, pipeline, planning, scale, series, simulation, starts, table
from benchmarks.measure import machine, versions
from robojoule.documents import write_document


def main() -> None:
    """Measure everything, one after another."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--full", action="store_true", help="also 100 000 motions and the whole pipeline (minutes)")
    full = parser.parse_args().full
    results: dict[str, object] = {"machine": machine(), "versions": versions()}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        works: dict[str, Callable[[], object]] = {
            "simulation": lambda: simulation.measure(1000, 20, 9),
            "series": lambda: series.measure(folder),
            "planning": planning.measure,
            "commands": commands.measure,
            "starts": lambda: starts.measure(folder),
            "scale": lambda: scale.measure(folder, full),
            **({"pipeline": lambda: pipeline.measure(folder)} if full else {}),
        }
        for title, work in works.items():
            with threadpool_limits(1):
                results[title] = work()
            print(f"benchmarks: {title}: {results[title]}", flush=True)
    write_document(table.RESULTS, results)
    table.update()


if __name__ == "__main__":
    main()
