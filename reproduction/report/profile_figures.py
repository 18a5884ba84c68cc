"""Figures of single energy profiles: thesis Figures 3.2, 3.3, 4.2, 4.4, 6.1."""

from __future__ import annotations

from typing import Any

import numpy as np

from reproduction.methods.polynomial_profile import POWERS, fit_polynomial
from reproduction.report.drawing import Drawing, curve, smooth_profile, spread
from reproduction.report.results import Results
from robojoule.arrays import Array
from robojoule.plots.style import BLUE, GREEN, GREY, MINUS, ORANGE, RED, Style
from robojoule.profile.sampled import SampledProfile, sampled_profile

EXAMPLES = 6
CHORDS = 6  # of Figure 3.3
KRC_CHORDS = 4  # of Figure 6.1
PROFILING_RUNS = 5
DENSE_RUNS = 91

# The thesis's example (its Figure 4.2): fastest, optimal and slowest run.
THESIS_DURATIONS_S, THESIS_ENERGIES_J = (0.63, 0.94, 3.76), (1340.0, 1144.0, 2800.0)


def energy_profiles(results: Results, style: Style) -> Drawing:
    """Figure 3.2: how much profiles vary."""
    chosen = results.query(
        "SELECT motion_id, tree_id FROM features WHERE duration_slowest_s > duration_fastest_s"
        " ORDER BY optimal_duration_s / duration_fastest_s, motion_id"
    )
    places = spread(len(chosen["motion_id"]), EXAMPLES)
    figure, axes = style.figure(0.62, 2, 3, squeeze=False)
    for ax, place in zip(axes.flat, places, strict=False):
        _draw_runs(ax, results, int(chosen["motion_id"][place]))
        ax.set_title(f"{chosen['tree_id'][place]}, motion {chosen['motion_id'][place]}", fontsize=8)
    for ax in axes.flat[len(places) :]:
        ax.set_axis_off()
    figure.supxlabel("duration [s]", fontsize=9)
    figure.supylabel("energy [J]", fontsize=9)
    return Drawing(
        figure,
        f"{len(places)} energy profiles, from the earliest to the latest optimum relative to the fastest run (equal "
        "steps of rank). Red: simulated runs of distinct duration; blue: simulated at "
        f"{DENSE_RUNS} speed limits; dashed: Eq. 3.1 through the red runs.",
        f"{len(places)} small plots of energy over duration; each falls steeply, has a minimum, then rises almost as a "
        "straight line, with the minimum at different places.",
    )


def linear_approximation(results: Results, style: Style) -> Drawing:
    """Figure 3.3: a polynomial profile and its chords."""
    motion = typical_motion(results)
    polynomial = smooth_profile(results.profile(motion))
    chords = polynomial.chords(CHORDS) if hasattr(polynomial, "chords") else polynomial
    figure, ax = style.figure()
    ax.plot(*curve(polynomial), color=BLUE, label="polynomial, Eq. 3.1")
    ax.plot(chords.durations_s, chords.energies_j, "o-", color=RED, markersize=4, label=f"{chords.segments} chords")
    _name_axes(ax)
    ax.legend()
    return Drawing(
        figure,
        f"Polynomial profile of motion {motion} and its {chords.segments} chords between equidistant durations. "
        "The planning model sees the chords.",
        "Energy over duration: a smooth curve and a chain of straight chords above it, farthest off where "
        "the curve falls steeply.",
    )


def annotated_profile(results: Results, style: Style) -> Drawing:
    """Figure 4.2: the three segments, on the motion that comes closest to the thesis's example."""
    motion = typical_motion(results)
    profile = results.profile(motion)
    durations, energies = profile.durations_s, profile.energies_j
    before, after = durations[max(profile.optimum - 1, 0)], durations[min(profile.optimum + 1, len(profile) - 1)]
    figure, ax = style.figure()
    spans = [
        (durations[0], before, RED, "decreasing"),
        (before, after, GREY, "near constant"),
        (after, durations[-1], ORANGE, "increasing"),
    ]
    for start, end, color, label in spans:
        if end > start:
            ax.axvspan(start, end, color=color, alpha=0.14, linewidth=0, label=f"{label} consumption")
    _draw_runs(ax, results, motion)
    ax.plot(
        THESIS_DURATIONS_S,
        THESIS_ENERGIES_J,
        "D",
        color=GREEN,
        fillstyle="none",
        markersize=7,
        label="the thesis's example (three runs)",
    )
    optimum = profile.optimum
    ax.annotate(
        f"optimum: {durations[optimum]:.2f} s, {energies[optimum]:.0f} J",
        (durations[optimum], energies[optimum]),
        xytext=(0.25, 0.10),
        textcoords="axes fraction",
        arrowprops={"arrowstyle": "->", "color": "#333333"},
    )
    ax.set_ylim(bottom=min(energies.min(), min(THESIS_ENERGIES_J)) * 0.72)
    _name_axes(ax)
    ax.legend(loc="upper left")
    points = ", ".join(f"{durations[i]:.2f} s {energies[i]:.0f} J" for i in (0, optimum, len(profile) - 1))
    return Drawing(
        figure,
        f"Motion {motion}, the one nearest to the thesis's example in duration and energy: fastest, optimal and "
        f"slowest run are {points} (thesis: 0.63 s 1340 J, 0.94 s 1144 J, 3.76 s 2800 J). The near-constant segment "
        "reaches one run to both sides of the optimum.",
        "Energy over duration of one motion with three shaded segments: decreasing, near constant, increasing "
        f"consumption; the optimum is at {durations[optimum]:.2f} s and {energies[optimum]:.0f} J.",
    )


def same_steepness(results: Results, style: Style) -> Drawing:
    """Figure 4.4: two profiles of the same steepness and very different saving."""
    rows = results.query(
        "SELECT motion_id, steepness_j_per_s AS steepness, energy_saving_j AS saving FROM features"
        " WHERE steepness_j_per_s > 0 AND energy_saving_j >="
        "  (SELECT quantile_cont(energy_saving_j, 0.25) FROM features WHERE steepness_j_per_s > 0)"
        " ORDER BY steepness_j_per_s, motion_id"
    )
    figure, ax = style.figure()
    low, high = _pair_of_same_steepness(rows["steepness"], rows["saving"])
    texts = []
    for place, color in dict.fromkeys(zip((low, high), (BLUE, RED), strict=True)):
        if place < 0:
            continue
        profile = results.profile(rows["motion_id"][place])
        d, e, best = profile.durations_s, profile.energies_j, profile.optimum
        ax.plot(*_dense(results, rows["motion_id"][place]), color=color, label=f"motion {rows['motion_id'][place]}")
        ax.plot(d, e, "o", color=color, markersize=4)
        ax.plot([d[0], d[best]], [e[0], e[best]], "--", color=color)
        texts.append(
            f"motion {rows['motion_id'][place]} saves {rows['saving'][place]:.0f} J at "
            f"{rows['steepness'][place]:.0f} J/s"
        )
    _name_axes(ax)
    if texts:
        ax.legend(title="dashed: steepness (Eq. 4.1)")
    return Drawing(
        figure,
        "Two profiles of (almost) the same steepness: " + "; ".join(texts) + ".",
        "Two profiles of energy over duration whose falling parts have equal slope though one is much deeper.",
    )


def krc_chords(results: Results, style: Style) -> Drawing:
    """Figure 6.1: the profile as the original plug-in sees it, for the motion of Figure 4.2."""
    motion = typical_motion(results)
    runs = _profiling_runs(results, motion)
    figure, ax = style.figure()
    truth = results.profile(motion)
    ax.plot(truth.durations_s, truth.energies_j, "o", color=GREY, markersize=5, label="simulated runs")
    if len(runs) >= POWERS.size:
        polynomial = fit_polynomial(runs.durations_s, runs.energies_j)
        chords = polynomial.chords(KRC_CHORDS)
        ax.plot(*curve(polynomial), color=GREEN, label="polynomial through five runs")
    else:
        chords = runs.piecewise()
    ax.plot(chords.durations_s, chords.energies_j, "s-", color=RED, markersize=4, label=f"{chords.segments} chords")
    ax.plot(runs.durations_s, runs.energies_j, "o", color=GREEN, fillstyle="none", markersize=8, label="the five runs")
    _name_axes(ax)
    ax.legend()
    slopes = ", ".join(f"{slope:.0f} W" for slope in chords.slopes_w).replace("-", MINUS)
    return Drawing(
        figure,
        f"KRC profile of motion {motion}: the polynomial through five runs equidistant in speed and its "
        f"{chords.segments} chords, equidistant in duration; slopes {slopes}. The first chord spans the falling part "
        "and the minimum.",
        "Energy over duration: simulated runs, a polynomial through five of them and straight chords that cut across "
        "the minimum.",
    )


def _profiling_runs(results: Results, motion: int) -> SampledProfile:
    """Five runs equidistant in speed, from the slowest speed limit to the lowest one that gives the fastest run."""
    paths = results.paths([motion])
    slowest = float(results.profile(motion).speed_limits.min())
    top = max(float(paths.fastest_speed_limits()[0]), slowest)
    runs = paths.simulate(np.linspace(slowest, top, PROFILING_RUNS))
    return sampled_profile(runs.duration_s[0], runs.energy_j[0], runs.speed_limit[0])


def typical_motion(results: Results) -> int:
    """The motion whose fastest, optimal and slowest run come closest to the thesis's example."""
    fast, best, slow = THESIS_DURATIONS_S
    rows = results.query(
        "SELECT motion_id FROM features JOIN ("
        "  SELECT motion_id, min(energy_j) AS energy_j FROM runs GROUP BY motion_id) USING (motion_id)"
        " WHERE duration_fastest_s > 0 AND optimal_duration_s > duration_fastest_s"
        " ORDER BY abs(ln(duration_fastest_s / ?)) + abs(ln(optimal_duration_s / ?)) + abs(ln(duration_slowest_s / ?))"
        " + abs(ln(energy_j / ?)), motion_id LIMIT 1",
        fast,
        best,
        slow,
        THESIS_ENERGIES_J[1],
    )
    if len(rows["motion_id"]):
        return int(rows["motion_id"][0])
    return int(results.query("SELECT min(motion_id) AS motion_id FROM runs")["motion_id"][0])


def _pair_of_same_steepness(steepness: Any, saving: Any) -> tuple[int, int]:
    """Of neighbours in steepness (within 1 %, between its quartiles) the two that differ most in saving."""
    count = len(steepness)
    if count < 2:
        return (count - 1, count - 1)
    logarithm = np.log(saving)
    best, pair = -1.0, (0, 1)
    for low in range(count // 4, max(3 * count // 4, count // 4 + 1)):
        high = low + 1
        while high < count and (high == low + 1 or steepness[high] <= 1.01 * steepness[low]):
            ratio = abs(float(logarithm[high] - logarithm[low]))
            if ratio > best:
                best, pair = ratio, (low, high)
            high += 1
    return pair


def _dense(results: Results, motion: int) -> tuple[Array, Array]:
    """Durations [s] and energies [J] of a motion at many speed limits between the slowest and the fastest run."""
    slowest = float(results.profile(motion).speed_limits.min())
    runs = results.paths([int(motion)]).simulate(np.geomspace(slowest, 1.0, DENSE_RUNS))
    profile = sampled_profile(runs.duration_s[0], runs.energy_j[0], runs.speed_limit[0])
    return profile.durations_s, profile.energies_j


def _draw_runs(ax: Any, results: Results, motion: int) -> None:
    profile = results.profile(motion)
    ax.plot(*_dense(results, motion), color=BLUE, label="simulated profile")
    ax.plot(*curve(smooth_profile(profile)), "--", color=GREY, linewidth=0.9, label="polynomial, Eq. 3.1")
    ax.plot(profile.durations_s, profile.energies_j, "o", color=RED, markersize=4, label="simulated runs")


def _name_axes(ax: Any) -> None:
    ax.set(xlabel="duration [s]", ylabel="energy [J]")
