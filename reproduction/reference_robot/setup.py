"""What the fit of the reference robot starts from: `targets.yaml`."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Annotated

from pydantic import Field

from robojoule.calibration.parameters import Transform, share_of_range
from robojoule.documents import Document, load

FOLDER = Path(__file__).parent
Range = tuple[float, float]
NonNegative = Annotated[float, Field(ge=0)]


class PublishedFigure(Document):
    """A figure that the thesis gives, and within which bounds the model is called credible.

    Attributes:
        figure: What it is.
        published: What the thesis says.
        source: Where it says so, or how it was inferred.
        bounds: Least and largest credible value.
        weight: What a miss by half the width of the bounds weighs in the fit; 0 for figures that are only checked.
        margin: Share of the bounds by which the fit keeps off them: extremes grow with the trees that one looks at.
    """

    figure: str
    published: str
    source: str
    bounds: Range
    weight: NonNegative = 1.0
    margin: NonNegative = 0.0


class Parameter(Document):
    """A fitted parameter: range and prior, and where they come from. Its scale is logarithmic unless it may be 0."""

    range: Range
    prior: float
    reason: str

    @property
    def transform(self) -> Transform:
        """Value from the share of the range."""
        return share_of_range(*self.range)


class Trees(Document):
    """The fit's own trees."""

    seed: int
    count: int
    points: int
    budget_rad: Range
    use_whole_budget: bool


class Optimiser(Document):
    """Differential evolution from the best of some trial points; weight of the prior."""

    seed: int
    trials: int
    population: Annotated[int, Field(ge=5)]
    generations: int
    prior_weight: float


class FitSetup(Document):
    """`targets.yaml`."""

    robot: str
    payload_kg: float
    trees: Trees
    figures: dict[str, PublishedFigure]
    parameters: dict[str, Parameter]
    gear_ratio: list[float]
    fixed: dict[str, float]
    optimiser: Optimiser


@cache
def fit_setup() -> FitSetup:
    """The fit's targets, ranges and seeds."""
    return load(FitSetup, FOLDER / "targets.yaml")
