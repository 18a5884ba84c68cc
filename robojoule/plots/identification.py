"""The plot of an identification: measured against modelled power."""

from __future__ import annotations

from pathlib import Path

from robojoule.calibration.identification import Identification
from robojoule.documents import atomic_path

PLOT_SUFFIXES = (".svg", ".png", ".pdf")
SHOWN_S = 40.0  # more motions in the upper panel would be a smear


def write_plot(result: Identification, path: str) -> None:
    """Draw power over time (the end of the log) and measured against modelled power, and write it atomically."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    time, measured, modelled = result.window_time_s, result.measured_w, result.modelled_w
    held_out = result.window_held_out
    figure = Figure(figsize=(10.0, 7.5), layout="constrained")
    upper, lower = figure.subplots(2, 1, height_ratios=[1.0, 1.2])
    shown = time >= time[-1] - SHOWN_S
    upper.plot(time[shown], measured[shown], color="0.55", linewidth=2.0, label="measured")
    upper.plot(time[shown], modelled[shown], color="C0", linewidth=1.0, label="modelled")
    top = float(measured[shown].max())
    upper.fill_between(
        time[shown], 0.0, top, where=held_out[shown], color="C1", alpha=0.15, linewidth=0.0, label="held out"
    )
    upper.set(xlabel="time [s]", ylabel="mains power [W]", title=f"{result.robot.name}: {Path(result.source).name}")
    upper.legend(loc="upper right")
    lower.plot(measured[~held_out], modelled[~held_out], ".", color="0.7", markersize=3, label="fitted windows")
    score = result.held_out
    label = f"held out: R2 {score.r2:.4f}, RMSE {score.rmse_w:.1f} W ({score.rmse_percent:.2f} % of mean power)"
    lower.plot(measured[held_out], modelled[held_out], ".", color="C1", markersize=4, label=label)
    limits = [float(min(measured.min(), modelled.min())), float(max(measured.max(), modelled.max()))]
    lower.plot(limits, limits, color="k", linewidth=0.8)
    lower.set(xlabel="measured power [W]", ylabel="modelled power [W]")
    lower.legend(loc="upper left")
    metadata = {"Date": None} if Path(path).suffix.lower() == ".svg" else None
    with mpl.rc_context({"svg.hashsalt": "robojoule"}), atomic_path(path) as temporary:
        figure.savefig(temporary, metadata=metadata)
