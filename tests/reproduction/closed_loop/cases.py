"""Parameters of a small study on hidden machines."""

from reproduction.study.config import CloseTheLoopParams, load_study_params

PARAMS = load_study_params()


def small(**changes) -> CloseTheLoopParams:
    """Few trees and draws; ranges are those of the study."""
    few = {"trees": 1, "noise_draws": 2, "stopwatch_draws": 1, "cycle_times_percent": [133.0], "seed": 5}
    return CloseTheLoopParams(**PARAMS.close_the_loop.model_dump() | few | changes)
