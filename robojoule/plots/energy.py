"""Where the energy of a motion goes over its duration: parts of the mains energy, stacked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from robojoule.arrays import Array
from robojoule.plots.style import Style, svg_text
from robojoule.profile.energy_profile import PARTS, EnergyProfile

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Labels of the parts, in the order in which they are stacked.
ENERGY_PARTS = dict(
    zip(
        PARTS,
        ("base", "drives active", "inverter loss", "copper loss", "friction", "brake chopper", "change of height"),
        strict=True,
    )
)


def stacked_over_duration(rows: Mapping[str, Array], style: Style) -> Figure:
    """Parts of one motion's energy, stacked.

    Args:
        rows: `duration_s` (rising), `energy_j` and the parts, each of shape (S,).
        style: Look of the figure.
    """
    figure, ax = style.figure(0.64)
    duration, parts = rows["duration_s"], used_parts(rows)
    # Energy gained by going down is drawn below zero, so that the stack ends at the sum.
    positive, negative = np.zeros_like(duration), np.zeros_like(duration)
    for part, color in zip(parts, style.colors(len(parts)), strict=True):
        gain, loss = np.minimum(rows[part], 0.0), np.maximum(rows[part], 0.0)
        ax.fill_between(duration, positive, positive + loss, color=color, linewidth=0, label=ENERGY_PARTS[part])
        ax.fill_between(duration, negative, negative + gain, color=color, linewidth=0)
        positive, negative = positive + loss, negative + gain
    ax.plot(duration, rows["energy_j"], "o-", color="black", markersize=3, linewidth=1.0, label="sum: mains energy")
    ax.set_xlabel("duration [s]")
    ax.set_ylabel("energy [J]")
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def used_parts(rows: Mapping[str, Array]) -> list[str]:
    """Parts that the energy model uses: a constant drive-active power, for one, may be zero."""
    return [part for part in ENERGY_PARTS if np.abs(rows[part]).max(initial=0.0) > 1e-6]


def drawing_of(profile: EnergyProfile) -> str:
    """Draw where the energy of a motion goes, as SVG text."""
    style = Style()
    rows = {"duration_s": profile.durations_s, "energy_j": profile.energies_j, **profile.parts_j}
    with style.applied():
        return svg_text(stacked_over_duration({name: values[::-1] for name, values in rows.items()}, style))
