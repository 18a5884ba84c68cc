"""The thesis's claims about plans (chapter 6), beside what comes out here."""

from __future__ import annotations

import numpy as np

from reproduction.claims import Claim
from reproduction.experiment.results import ExperimentResults
from reproduction.methods.krc_polynomial import PROFILING_RUNS, profiling_speed_limits
from reproduction.methods.method import Variant
from reproduction.methods.predicted_three_segment import PREDICTOR_RUNS
from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch

PREDICTED = Variant("predicted_three_segment")
SLOWED = 1.01  # a motion counts as slowed beyond this multiple of its least duration
# Thesis Table 6.1: saving with the polynomial and with the predicted profiles. [%]
THESIS_SAVINGS = {
    (110.0, 4): (13.37, 17.42),
    (121.0, 4): (24.14, 28.19),
    (133.0, 4): (32.76, 34.10),
    (150.0, 4): (35.89, 35.81),
    (175.0, 4): (43.06, 41.04),
    (200.0, 4): (49.64, 47.17),
    (110.0, 6): (12.75, 17.62),
    (121.0, 6): (25.93, 32.36),
    (133.0, 6): (37.26, 38.07),
}
RANGE_TOLERANCE = 5.0  # percentage points by which the range of savings may miss the thesis's


def plan_claims(results: ExperimentResults, batch: TreeBatch, krc_slowest: float) -> list[Claim]:
    """Claims about plans; those without data are left out.

    Args:
        results: Plans of all methods.
        batch: Their trees.
        krc_slowest: Speed limit of the slowest profiling run of `krc_polynomial`. [-]
    """
    rows = _order_of_methods(results) + _more_segments(results) + _range(results)
    if PREDICTED in results.outcomes and _krc_segments(results):
        segments = min(_krc_segments(results))
        rows += _spread(results, segments) + _waits(results, segments)
    return rows + _profiling(results, batch, krc_slowest)


def _krc_segments(results: ExperimentResults) -> list[int]:
    return [variant.krc_segments for variant in results.quoted().values() if variant.krc_segments is not None]


def _order_of_methods(results: ExperimentResults) -> list[Claim]:
    rows = []
    for (percent, segments), (krc, predicted) in THESIS_SAVINGS.items():
        if percent not in results.cycle_times_percent or segments not in _krc_segments(results):
            continue
        found = results.savings_percent(PREDICTED, percent).mean(), _krc_saving(results, segments, percent)
        above = predicted > krc
        rows.append(
            Claim(
                f"at {percent:g} % the predicted profiles save {'more' if above else 'less'} than the polynomial "
                f"ones with {segments} segments",
                f"{predicted:.2f} % against {krc:.2f} %",
                f"{found[0]:.2f} % against {found[1]:.2f} %",
                bool((found[0] > found[1]) == above),
            )
        )
    return rows


def _krc_saving(results: ExperimentResults, segments: int, percent: float) -> float:
    return float(results.savings_percent(results.krc(segments), percent).mean())


def _more_segments(results: ExperimentResults) -> list[Claim]:
    if not {4, 6} <= set(_krc_segments(results)):
        return []
    rows = []
    for percent in results.cycle_times_percent:
        if (percent, 6) not in THESIS_SAVINGS:
            continue
        found = [_krc_saving(results, segments, percent) for segments in (4, 6)]
        thesis = [THESIS_SAVINGS[percent, segments][0] for segments in (4, 6)]
        rows.append(
            Claim(
                f"at {percent:g} % six segments of the polynomial profile save more than four",
                f"{thesis[1]:.2f} % against {thesis[0]:.2f} % (other trees)",
                f"{found[1]:.2f} % against {found[0]:.2f} % (the same trees)",
                found[1] > found[0],
            )
        )
    return rows


def _range(results: ExperimentResults) -> list[Claim]:
    savings = []
    for percent, segments in THESIS_SAVINGS:
        if percent in results.cycle_times_percent and segments in _krc_segments(results):
            for variant in (PREDICTED, results.krc(segments)):
                published = results.published_savings_percent(variant, percent)
                if published is not None:
                    savings.append(float(published.mean()))
    if not savings:
        return []
    low, high = min(savings), max(savings)
    held = abs(low - 13.0) <= RANGE_TOLERANCE and abs(high - 50.0) <= RANGE_TOLERANCE
    return [
        Claim(
            f"average savings range from 13 % to 50 % (published convention, ends within {RANGE_TOLERANCE:g} points)",
            "12.75 % to 49.64 %",
            f"{low:.2f} % to {high:.2f} %",
            held,
        )
    ]


def _spread(results: ExperimentResults, segments: int) -> list[Claim]:
    percent = min(results.cycle_times_percent)

    def slowed(variant: Variant) -> float:
        pairs = zip(results.runs(variant, percent), results.runs(Variant("unoptimized"), percent), strict=True)
        return float(np.mean([(run.durations_s > SLOWED * fastest.durations_s).sum() for run, fastest in pairs]))

    found = slowed(PREDICTED), slowed(results.krc(segments))
    return [
        Claim(
            f"at {percent:g} % the predicted profiles slow down more motions than the polynomial ones",
            "11 of 11 against 6 of 11 motions (Figure 6.2, one tree)",
            f"{found[0]:.1f} against {found[1]:.1f} motions of a tree on average",
            found[0] > found[1],
        )
    ]


def _waits(results: ExperimentResults, segments: int) -> list[Claim]:
    percent = max(results.cycle_times_percent)

    def mid_cycle(variant: Variant) -> float:
        runs = results.runs(variant, percent)
        return float(np.mean([_mid_cycle_wait_s(run.prior_waits_s, run.post_waits_s) for run in runs]))

    found = mid_cycle(PREDICTED), mid_cycle(results.krc(segments))
    return [
        Claim(
            f"at {percent:g} % the predicted profiles insert longer waits in the middle of the cycle",
            "about 2 s against none; less than 1 s at the beginning (Figure 6.3, one tree)",
            f"{found[0]:.2f} s against {found[1]:.2f} s away from HOME on average",
            found[0] > found[1],
        )
    ]


def _mid_cycle_wait_s(prior_s: Array, post_s: Array) -> float:
    """Waits neither before the first nor after the last motion. [s]"""
    return float(prior_s[1:].sum() + post_s[:-1].sum())


def _profiling(results: ExperimentResults, batch: TreeBatch, krc_slowest: float) -> list[Claim]:
    rows = []
    if _krc_segments(results):
        speed, duration = (results.spacing_saving_percent(spacing) for spacing in ("speed", "duration"))
        rows.append(
            Claim(
                "the polynomial is fitted to five runs whose spacing matters little (below one percentage point)",
                "spacing not stated",
                f"mean saving {speed:.2f} % equidistant in speed, {duration:.2f} % in duration; quoted: "
                f"{results.quoted_spacing}",
                abs(speed - duration) < 1.0,
            )
        )
    five = float(batch.paths.durations(profiling_speed_limits(batch, "speed", krc_slowest)).sum())
    two = float((batch.d_min_s + batch.d_max_s).sum())
    rows.append(
        Claim(
            "two profiling runs instead of five nearly halve the time for obtaining profiles",
            "2 against 5 runs, nearly half the time",
            f"{PREDICTOR_RUNS} against {PROFILING_RUNS} runs, {100.0 * two / five:.0f} % of the simulated motion time",
            two / five < 0.65,
        )
    )
    return rows
