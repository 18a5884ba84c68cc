"""Energy profiles: the electrical energy E(d) of a motion over its duration d (thesis 3.2 and 5.1)."""

from robojoule.profile.measured import MeasuredProfile, measured_profile
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.polynomial import PolynomialProfile, fit_polynomial
from robojoule.profile.three_segment import ThreeSegmentShape, three_segment_profile

__all__ = [
    "MeasuredProfile",
    "PiecewiseLinearProfile",
    "PolynomialProfile",
    "ThreeSegmentShape",
    "fit_polynomial",
    "measured_profile",
    "three_segment_profile",
]
