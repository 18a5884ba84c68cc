"""The UR3e validation as a table and a figure: `python -m benchmarks.validate_ur3e [--figure FILE.svg]`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from reproduction.validation.ur3e import Comparison, identified_on_one_half, with_catalog
from robojoule.documents import atomic_path

TITLES = ("catalog, nothing fitted", "identified on the second half", "identified on the first half")


def comparisons() -> dict[str, Comparison]:
    """The three comparisons by their titles: the whole recording, its first half, its second half."""
    parts = (with_catalog(), identified_on_one_half(first=False)[1], identified_on_one_half(first=True)[1])
    return dict(zip(TITLES, parts, strict=True))


def print_table(results: dict[str, Comparison]) -> None:
    """Standing power, energy above it, errors."""
    for title, result in results.items():
        (rest, own_rest), (above, own_above) = result.rest_w, result.above_rest_j
        errors = np.abs(result.motion_errors_percent)
        print(f"{title}: {result.window_s.sum():.1f} s, {errors.size} motions")
        print(f"  standing {own_rest:.1f} W, measured {rest:.1f} W")
        print(
            f"  above standing {own_above:.1f} J, measured {above:.1f} J ({result.above_rest_error_percent:+.1f} %), "
            f"RMSE {result.rmse_above_rest_w:.2f} W; {result.energy_error_percent:+.2f} % of all energy"
        )
        print(
            f"  motions off by {errors.mean():.1f} % on average, {errors.max():.1f} % at most; "
            f"RMSE {result.rmse_w:.2f} W"
        )


def draw(path: Path, results: dict[str, Comparison]) -> None:
    """Power of the arm above standing over time with the catalog's figures, and as it is with identified ones."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "ur3e", "font.size": 7, "axes.linewidth": 0.5, "path.simplify": True})
    from matplotlib import pyplot as plt

    figure, (above, whole) = plt.subplots(2, 1, figsize=(7.2, 4.4), sharex=True, layout="constrained")
    catalog, *halves = results.values()
    rest, own_rest = catalog.rest_w
    above.plot(catalog.time_s, catalog.measured_w - rest, color="0.65", linewidth=1.2, label="measured")
    above.plot(catalog.time_s, catalog.modelled_w - own_rest, color="C0", linewidth=0.7, label="model")
    above.set(ylabel="power above standing [W]", title=TITLES[0])
    for half in halves:
        whole.plot(half.time_s, half.measured_w, color="0.65", linewidth=1.2)
        whole.plot(half.time_s, half.modelled_w, color="C0", linewidth=0.7)
    whole.axvline(halves[1].time_s[0], color="0.3", linewidth=0.5, linestyle=":")
    whole.set(ylabel="power of the arm [W]", xlabel="time [s]", title="each half identified on the other one")
    figure.legend(*above.get_legend_handles_labels(), loc="outside lower center", frameon=False, ncols=2)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="svg", metadata={"Date": None, "Creator": None})
    plt.close(figure)


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare the UR3e model with the committed recording."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.validate_ur3e", description=main.__doc__)
    parser.add_argument("--figure", type=Path, metavar="FILE", help="draw powers into this SVG")
    parsed = parser.parse_args(arguments)
    results = comparisons()
    print_table(results)
    if parsed.figure:
        draw(parsed.figure, results)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
