"""The plot of an identification: measured against modelled power."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from robojoule.calibration.identification import Identification
from robojoule.plots.style import BLUE, GREY, ORANGE, Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLOT_SUFFIXES = (".svg", ".png", ".pdf")
SHOWN_S = 40.0  # more motions in the upper panel would be a smear


def drawing_of(result: Identification, suffix: str) -> bytes:
    """Draw power over time (the end of the log) and measured against modelled power, as a file of a suffix."""
    style = Style(width_in=9.0)
    metadata = {"Date": None, "Creator": None} if suffix.lower() == ".svg" else None
    drawn = io.BytesIO()
    with style.applied():
        _figure(result, style).savefig(drawn, format=suffix.lower()[1:], metadata=metadata)
    return drawn.getvalue()


def _figure(result: Identification, style: Style) -> Figure:
    time, measured, modelled = result.window_time_s, result.measured_w, result.modelled_w
    held_out = result.window_held_out
    figure, (upper, lower) = style.figure(0.75, 2, height_ratios=[1.0, 1.2])
    shown = time >= time[-1] - SHOWN_S
    upper.plot(time[shown], measured[shown], color=GREY, linewidth=2.0, label="measured")
    upper.plot(time[shown], modelled[shown], color=BLUE, linewidth=1.0, label="modelled")
    top = float(measured[shown].max())
    upper.fill_between(
        time[shown], 0.0, top, where=held_out[shown], color=ORANGE, alpha=0.15, linewidth=0.0, label="held out"
    )
    upper.set(xlabel="time [s]", ylabel="mains power [W]", title=f"{result.robot.name}: {Path(result.source).name}")
    upper.legend(loc="upper right")
    lower.plot(measured[~held_out], modelled[~held_out], ".", color=GREY, markersize=3, label="fitted windows")
    score = result.held_out
    label = f"held out: R2 {score.r2:.4f}, RMSE {score.rmse_w:.1f} W ({score.rmse_percent:.2f} % of mean power)"
    lower.plot(measured[held_out], modelled[held_out], ".", color=ORANGE, markersize=4, label=label)
    limits = [float(min(measured.min(), modelled.min())), float(max(measured.max(), modelled.max()))]
    lower.plot(limits, limits, color="black", linewidth=0.8)
    lower.set(xlabel="measured power [W]", ylabel="modelled power [W]")
    lower.legend(loc="upper left")
    return figure
