"""Where the energy of a motion goes over its duration, as a drawing."""

from __future__ import annotations

from robojoule.plots.style import Style, stacked_over_duration, svg_text
from robojoule.profile.energy_profile import EnergyProfile


def drawing_of(profile: EnergyProfile) -> str:
    """Draw where the energy of a motion goes, as SVG text."""
    style = Style()
    rows = {"duration_s": profile.durations_s, "energy_j": profile.energies_j, **profile.parts_j}
    with style.applied():
        return svg_text(stacked_over_duration({name: values[::-1] for name, values in rows.items()}, style))
