"""One style for all figures, how parts of energy are stacked, and files whose bytes depend on the content alone."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.profile.energy_profile import PARTS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MINUS = "\N{MINUS SIGN}"
# Colours with a meaning; all have a contrast of 3:1 or more on white. The colour map serves what has no fixed meaning.
RED, BLUE, GREEN, ORANGE, GREY = "#c62828", "#1f5fa8", "#1b7f3b", "#c25700", "#6b7280"
UNDER, OVER = RED, ORANGE  # outliers: predicted too low, too high
# Labels of the parts, in the order in which they are stacked.
ENERGY_PARTS = dict(
    zip(
        PARTS,
        ("base", "drives active", "inverter loss", "copper loss", "friction", "brake chopper", "change of height"),
        strict=True,
    )
)

_RC: dict[str, Any] = {
    "svg.hashsalt": "robojoule",  # element names depend on the content, not on chance
    "svg.fonttype": "path",  # glyphs are drawn: the same picture whatever fonts the reader has
    "font.family": "DejaVu Sans",  # comes with Matplotlib
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9.0,
    "legend.fontsize": 8.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e6ea",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "figure.facecolor": "white",
}


@dataclass(frozen=True)
class Style:
    """Look of every figure.

    Attributes:
        width_in: Width of a figure. [in]
        dpi: Resolution of what is drawn as pixels inside a figure. [1/in]
        colormap: Name of a Matplotlib colour map.
    """

    width_in: float = 6.4
    dpi: int = 110
    colormap: str = "viridis"

    @contextmanager
    def applied(self) -> Iterator[None]:
        """Draw and save figures within this context.

        Raises:
            InputError: Matplotlib knows no colour map of that name.
        """
        import matplotlib

        if self.colormap not in matplotlib.colormaps:
            raise InputError(
                f"there is no colour map '{self.colormap}'",
                key="draw_figures.colormap",
                allowed="a name that Matplotlib knows, such as viridis, cividis, plasma",
            )
        with matplotlib.rc_context({**_RC, "figure.dpi": self.dpi, "savefig.dpi": self.dpi}):
            yield

    def figure(self, height: float = 0.58, rows: int = 1, columns: int = 1, **options: Any) -> tuple[Figure, Any]:
        """A figure and its axes.

        Args:
            height: Height as a share of the width.
            rows: Rows of axes.
            columns: Columns of axes.
            options: Further options of `Figure.subplots`.

        Returns:
            The figure, and one Axes or (if there are several) an array of Axes.
        """
        figure = self.blank(height)
        return figure, figure.subplots(rows, columns, **options)

    def blank(self, height: float = 0.58) -> Figure:
        """A figure without axes; `height` is a share of the width."""
        from matplotlib.figure import Figure

        return Figure(figsize=(self.width_in, self.width_in * height), layout="constrained")

    def colors(self, count: int) -> list[Any]:
        """`count` colours of the map, dark to light; its light end is left out because it vanishes on white."""
        import matplotlib

        shades = matplotlib.colormaps[self.colormap]
        return [shades(0.85 * place / max(count - 1, 1)) for place in range(count)]


def svg_text(figure: Figure) -> str:
    """A figure as SVG without date, version or path, so that equal figures are equal text."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


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
    ax.set(xlabel="duration [s]", ylabel="energy [J]")
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def used_parts(rows: Mapping[str, Array]) -> list[str]:
    """Parts that the energy model uses: a constant drive-active power, for one, may be zero."""
    return [part for part in ENERGY_PARTS if np.abs(rows[part]).max(initial=0.0) > 1e-6]
