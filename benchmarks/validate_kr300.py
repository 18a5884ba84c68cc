"""The KR300 validation as a table and a figure: `python -m benchmarks.validate_kr300 [--figure FILE.svg]`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from reproduction.validation.kr300 import Comparison, Kr300Model, Recording, load_excerpt
from robojoule.arrays import Array
from robojoule.documents import atomic_path

RUNS = ("a", "b")
DRAWN = 8  # every eighth sample: finer than a printed line


def print_table(results: dict[str, Comparison]) -> None:
    """Energies and per-joint R2 and RMS errors of each run."""
    for run, result in results.items():
        residual = np.sqrt(((result.modelled_nm - result.measured_nm) ** 2).mean(axis=0))
        print(
            f"run {run}: net energy {result.modelled_j:.0f} J, measured {result.measured_j:.0f} J "
            f"({result.energy_error_percent:+.2f} %), positive part {result.positive_error_percent:+.2f} %"
        )
        print("  R2          " + "  ".join(f"{value:7.3f}" for value in result.r2))
        print("  RMS [Nm]    " + "  ".join(f"{value:7.1f}" for value in residual))


def cumulative_kj(torque_nm: Array, recording: Recording) -> Array:
    """Net mechanical energy since the start, shape (T,). [kJ]"""
    power = (torque_nm * recording.velocity_rad_s).sum(axis=1)
    steps = np.diff(recording.time_s) * (power[1:] + power[:-1]) / 2.0
    return np.concatenate([[0.0], np.cumsum(steps)]) / 1000.0


def draw(path: Path, results: dict[str, Comparison], recordings: dict[str, Recording]) -> None:
    """Torque of every joint and the energy over time, one column per run."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "kr300", "font.size": 7, "axes.linewidth": 0.5, "path.simplify": True})
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(7, 2, figsize=(7.2, 8.4), sharex=True, layout="constrained")
    for column, run in enumerate(RUNS):
        result, recording = results[run], recordings[run]
        time = recording.time_s[::DRAWN]
        for joint in range(6):
            axis = axes[joint, column]
            axis.plot(time, result.measured_nm[::DRAWN, joint] / 1000.0, color="0.65", linewidth=1.1, label="measured")
            axis.plot(time, result.modelled_nm[::DRAWN, joint] / 1000.0, color="C0", linewidth=0.6, label="model")
            axis.set_ylabel(f"joint {joint + 1} [kNm]")
            axis.text(0.99, 0.93, f"R² = {result.r2[joint]:.3f}", transform=axis.transAxes, ha="right", va="top")
        energy = axes[6, column]
        energy.plot(time, cumulative_kj(result.measured_nm, recording)[::DRAWN], color="0.65", linewidth=1.4)
        energy.plot(time, cumulative_kj(result.modelled_nm, recording)[::DRAWN], color="C0", linewidth=0.8)
        energy.text(0.02, 0.93, f"{result.energy_error_percent:+.1f} %", transform=energy.transAxes, va="top")
        energy.set(ylabel="net energy [kJ]", xlabel="time [s]", xlim=(0, 10))
        axes[0, column].set_title(f"run {run}")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", frameon=False, ncols=2)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="svg", metadata={"Date": None, "Creator": None})
    plt.close(figure)


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare the KR300 model with the committed recordings."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.validate_kr300", description=main.__doc__)
    parser.add_argument("--figure", type=Path, metavar="FILE", help="draw torques and energies into this SVG")
    parsed = parser.parse_args(arguments)
    model = Kr300Model()
    recordings = {run: load_excerpt(run) for run in RUNS}
    results = {run: model.compare(recording) for run, recording in recordings.items()}
    print_table(results)
    if parsed.figure:
        draw(parsed.figure, results, recordings)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
