"""The methods of the plan experiment by name, and what those that need data know of its motions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

from reproduction.config import EvaluatePlansParams
from reproduction.methods.greedy import Greedy
from reproduction.methods.krc_polynomial import POINT_SPACINGS, KrcPolynomial
from reproduction.methods.method import Method, Variant
from reproduction.methods.on_source import OnSource
from reproduction.methods.optimum import Optimum
from reproduction.methods.predicted_three_segment import PredictedThreeSegment
from reproduction.methods.robojoule_simulated import RobojouleSimulated
from reproduction.methods.three_segment_profile import ThreeSegmentShape
from reproduction.methods.uniform import Uniform
from reproduction.methods.unoptimized import Unoptimized
from robojoule.arrays import Array
from robojoule.profile.predicted import PredictedProfiles
from robojoule.profile.sampled import SampledProfile


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What the pipeline's files tell methods about the M motions of the experiment.

    Attributes:
        simulated: Distinct runs of each motion at the pipeline's speed limits.
        runs_per_motion: Number of these speed limits.
        final_power_w: Mean power before the destination of the slowest run, shape (M,). [W]
        predicted_parameters: Predicted saving [J], optimal duration [s] and penalty [J], shape (M, 3).
        predicted_profiles: Predicted profiles and idle power.
    """

    simulated: Sequence[SampledProfile]
    runs_per_motion: int
    final_power_w: Array
    predicted_parameters: Array
    predicted_profiles: PredictedProfiles

    def subset(self, motions: slice) -> Knowledge:
        """What they tell about some of the motions."""
        profiles = self.predicted_profiles
        known = {field.name: getattr(profiles, field.name)[motions] for field in fields(profiles)}
        return replace(
            self,
            simulated=self.simulated[motions],
            final_power_w=self.final_power_w[motions],
            predicted_parameters=self.predicted_parameters[motions],
            predicted_profiles=replace(profiles, **known),
        )


METHODS: dict[str, Callable[[Knowledge, EvaluatePlansParams], list[Method]]] = {
    "unoptimized": lambda known, settings: [Unoptimized()],
    "uniform": lambda known, settings: [Uniform()],
    "greedy": lambda known, settings: [Greedy(known.simulated, known.runs_per_motion)],
    "krc_polynomial": lambda known, settings: [
        KrcPolynomial(segments, spacing, known.final_power_w, settings.krc_slowest_percent / 100.0)
        for spacing in POINT_SPACINGS
        for segments in settings.krc_segments
    ],
    "predicted_three_segment": lambda known, settings: [
        PredictedThreeSegment(known.predicted_parameters, ThreeSegmentShape(**settings.three_segment.model_dump()))
    ],
    "robojoule_predicted": lambda known, settings: [OnSource(Variant("robojoule_predicted"), known.predicted_profiles)],
    "robojoule_simulated": lambda known, settings: [RobojouleSimulated()],
    "optimum": lambda known, settings: [Optimum(settings.dense_speed_limits)],
}
"""Every method's variants by the method's name, in the order of the tables."""
