"""The plot of energy over cycle time with the marginal power below it."""

from __future__ import annotations

from typing import Any

from robojoule.plots.style import BLUE, GREY, ORANGE, Style, svg_text


def drawing_of(result: dict[str, Any]) -> str:
    """Draw energy over cycle time; the same result gives the same bytes.

    Args:
        result: Plain data of a `TradeOff`.

    Returns:
        SVG text.
    """
    time, energy, power = (
        [point[name] for point in result["points"]] for name in ("cycle_time_s", "energy_j", "marginal_power_w")
    )
    style = Style()
    with style.applied():
        figure, (upper, lower) = style.figure(0.86, 2, sharex=True)
        upper.plot(time, energy, color=BLUE)
        if time[-1] >= result["best_cycle_time_s"]:
            upper.plot(result["best_cycle_time_s"], result["best_energy_j"], "o", color=ORANGE, label="least energy")
            upper.legend()
        title = f"{result['program']}, {result['robot']}, {result['payload_kg']:g} kg"
        upper.set(ylabel="energy per cycle [J]", title=title)
        lower.step(time, power, where="post", color=BLUE)
        lower.axhline(0.0, color=GREY, linewidth=0.8)
        # Near the fastest cycle the power may be beyond all bounds: the axis shows the part that differs.
        floor = power[min(len(power) // 50, len(power) - 1)]
        lower.set(xlabel="cycle time [s]", ylabel="marginal power [W]")
        if floor < power[-1]:
            margin = 0.05 * (power[-1] - floor)
            lower.set_ylim(floor - margin, power[-1] + margin)
        return svg_text(figure)
