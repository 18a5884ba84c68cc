"""A drawn figure with the words that go with it, and the selection of examples that figures share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reproduction.methods.polynomial_profile import POWERS, PolynomialProfile, fit_polynomial
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.sampled import SampledProfile

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CURVE_POINTS = 160


@dataclass(frozen=True)
class Drawing:
    """A figure and its text.

    Attributes:
        figure: What was drawn.
        caption: What is shown, with the figures that belong to it.
        alt: The same for people who do not see it.
    """

    figure: Figure
    caption: str
    alt: str


def smooth_profile(profile: SampledProfile) -> PolynomialProfile | PiecewiseLinearProfile:
    """Eq. 3.1 through all distinct runs; chords where there are fewer runs than coefficients."""
    if len(profile) < POWERS.size:
        return profile.piecewise()
    return fit_polynomial(profile.durations_s, profile.energies_j)


def curve(profile: PolynomialProfile | PiecewiseLinearProfile) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points of a profile to draw, denser where it bends: durations [s] and energies [J]."""
    share = np.linspace(0.0, 1.0, CURVE_POINTS) ** 2
    durations = profile.d_min_s + share * (profile.d_max_s - profile.d_min_s)
    return durations, profile.value(durations)


def spread(count: int, wanted: int) -> list[int]:
    """At most `wanted` of `count` places, evenly spread from the first to the last."""
    if count <= 0:
        return []
    return sorted({int(place) for place in np.linspace(0, count - 1, min(wanted, count)).round()})
