"""The plot of energy over cycle time with the marginal power below it."""

from __future__ import annotations

import io
from typing import Any


def drawing_of(result: dict[str, Any]) -> str:
    """Draw the curve of `robojoule pareto`; the same result gives the same bytes.

    Args:
        result: What the command found.

    Returns:
        SVG text.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    time, energy, power = (
        [point[name] for point in result["points"]] for name in ("cycle_time_s", "energy_j", "marginal_power_w")
    )
    figure = Figure(figsize=(7.0, 6.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    upper.plot(time, energy, color="C0")
    if time[-1] >= result["best_cycle_time_s"]:
        upper.plot(result["best_cycle_time_s"], result["best_energy_j"], "o", color="C1", label="least energy")
        upper.legend()
    upper.set(
        ylabel="energy of a cycle [J]", title=f"{result['program']}, {result['robot']}, {result['payload_kg']:g} kg"
    )
    lower.step(time, power, where="post", color="C0")
    lower.axhline(0.0, color="0.6", linewidth=0.8)
    # Near the fastest cycle the power may be beyond all bounds: the axis shows the part that differs.
    floor = power[min(len(power) // 50, len(power) - 1)]
    lower.set(xlabel="cycle time [s]", ylabel="marginal power [W]")
    if floor < power[-1]:
        margin = 0.05 * (power[-1] - floor)
        lower.set_ylim(floor - margin, power[-1] + margin)
    text = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "robojoule"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()
