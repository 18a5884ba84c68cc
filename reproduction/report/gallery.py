"""Every figure of the report: its file, its number in the thesis, its title and the function that draws it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from reproduction.layout import Layout
from reproduction.methods.three_segment_profile import ThreeSegmentShape
from reproduction.parts import Parts
from reproduction.report import (
    closed_loop_figure,
    energy_figures,
    feature_figures,
    gap_figures,
    plan_figures,
    predictor_figures,
    profile_figures,
    tree_figures,
)
from reproduction.report.drawing import Drawing
from reproduction.report.results import Results
from robojoule.documents import write_text
from robojoule.plots.style import Style, svg_text
from robojoule.robots.robot import Robot


@dataclass(frozen=True)
class Entry:
    """A figure of the report.

    Attributes:
        name: Stem of its file, `figure_4_1b` for Figure 4.1b of the thesis.
        chapter: Heading under which it stands.
        title: What it shows.
        draw: Function that draws it; None where the stages were not asked for its results.
    """

    name: str
    chapter: str
    title: str
    draw: Callable[[Results, Style], Drawing | None]

    @property
    def number(self) -> str:
        """Number in the thesis, empty for figures that it does not have."""
        return self.name.removeprefix("figure_").replace("_", ".") if self.name.startswith("figure_") else ""


@dataclass(frozen=True)
class Picture:
    """A drawn figure, ready for a file and for the page.

    Attributes:
        entry: Which figure it is.
        svg: Picture as SVG text.
        caption: What it shows, with numbers.
        alt: The same for people who do not see it.
    """

    entry: Entry
    svg: str
    caption: str
    alt: str


PROBLEM, ANALYSIS = "Optimisation graph and energy profile (chapter 3)", "Energy profile analysis (chapter 4)"
PREDICTION, RESULTS, BEYOND = "Prediction (chapter 5)", "Plans (chapter 6)", "Beyond the thesis"

ENTRIES = (
    Entry("figure_3_1", PROBLEM, "Optimisation graph", tree_figures.optimization_graph),
    Entry("figure_3_2", PROBLEM, "Examples of energy profiles", profile_figures.energy_profiles),
    Entry("figure_3_3", PROBLEM, "Linear approximation of a profile", profile_figures.linear_approximation),
    Entry("figure_4_1b", ANALYSIS, "Random operation tree", tree_figures.operation_tree),
    Entry("figure_4_2", ANALYSIS, "Example of an energy profile", profile_figures.annotated_profile),
    Entry("figure_4_3", ANALYSIS, "Steepness and simulated energy saving", feature_figures.steepness_and_saving),
    Entry("figure_4_4", ANALYSIS, "Two profiles of the same steepness", profile_figures.same_steepness),
    Entry("figure_4_5", ANALYSIS, "Correlations of static features", feature_figures.static_correlations),
    Entry(
        "figure_4_6", ANALYSIS, "Correlations of dynamic features, j1 to j3", feature_figures.dynamic_correlations_1_3
    ),
    Entry(
        "figure_4_7", ANALYSIS, "Correlations of dynamic features, j4 to j6", feature_figures.dynamic_correlations_4_6
    ),
    Entry("figure_5_1", PREDICTION, "Predicted and simulated energy saving", predictor_figures.predicted_saving),
    Entry("figure_5_2", PREDICTION, "Predicted and simulated optimal duration", predictor_figures.predicted_duration),
    Entry("figure_5_3", PREDICTION, "Predicted and simulated energy penalty", predictor_figures.predicted_penalty),
    Entry("figure_5_4", PREDICTION, "Predicted profiles over simulated runs", predictor_figures.predicted_profiles),
    Entry("figure_6_1", RESULTS, "Profile as the KRC method sees it", profile_figures.krc_chords),
    Entry("figure_6_2", RESULTS, "Optimised operation tree", plan_figures.optimised_trees),
    Entry("figure_6_3", RESULTS, "Power over one cycle", plan_figures.power_over_time),
    Entry("savings", BEYOND, "Savings over cycle time", gap_figures.savings),
    Entry("gap_to_optimum", BEYOND, "Gap to the proven optimum", gap_figures.gap_to_optimum),
    Entry(
        "gap_of_study", BEYOND, "Gap to the optimum where the robot differs from its entry", gap_figures.gap_of_study
    ),
    Entry("closed_loop", BEYOND, "Plans on machines that nobody has described", closed_loop_figure.closed_loop),
    Entry("ablations", BEYOND, "What each step brings", gap_figures.ablations),
    Entry("payload_sensitivity", BEYOND, "Sensitivity to the payload", plan_figures.payload_sensitivity),
    Entry("energy_over_duration", BEYOND, "Where the energy of a motion goes", energy_figures.breakdown_over_duration),
    Entry("energy_of_trees", BEYOND, "Where the energy of a cycle goes", energy_figures.breakdown_of_trees),
)


def draw_all(results: Results, style: Style, entries: tuple[Entry, ...] = ENTRIES) -> Iterator[Picture]:
    """Draw figures one after the other.

    Args:
        results: Results of the stages.
        style: Look.
        entries: Figures wanted.

    Yields:
        Pictures in the order of `entries`.

    Raises:
        InputError: A result is missing or unreadable; the colour map is unknown.
    """
    with style.applied():
        for entry in entries:
            drawing = entry.draw(results, style)
            if drawing is None:
                continue
            yield Picture(entry, svg_text(drawing.figure), drawing.caption, drawing.alt)


def draw_in_parts(results: Results, style: Style, parts: Parts) -> list[Picture]:
    """Draw all figures, in as many parts as there are processes; the pictures do not depend on how many.

    Args:
        results: Results of the stages.
        style: Look.
        parts: Where they are drawn.

    Returns:
        Pictures in the order of `ENTRIES`.

    Raises:
        InputError: As for `draw_all`.
    """
    shares = [ENTRIES[first :: parts.workers] for first in range(parts.workers)]
    tasks = [(results.layout, results.robot, results.shape, style, share) for share in shares if share]
    drawn = {picture.entry.name: picture for share in parts.map(_drawn, tasks) for picture in share}
    return [drawn[entry.name] for entry in ENTRIES if entry.name in drawn]


def _drawn(
    layout: Layout, robot: Robot, shape: ThreeSegmentShape, style: Style, entries: tuple[Entry, ...]
) -> list[Picture]:
    return list(draw_all(Results(layout, robot, shape), style, entries))


def write_pictures(pictures: Sequence[Picture], folder: Path) -> None:
    """Write drawn figures as files and remove those of an older version."""
    folder.mkdir(parents=True, exist_ok=True)
    names = {f"{picture.entry.name}.svg": picture.svg for picture in pictures}
    for stale in folder.glob("*.svg"):
        if stale.name not in names:
            stale.unlink()
    for name, svg in names.items():
        write_text(folder / name, svg)
