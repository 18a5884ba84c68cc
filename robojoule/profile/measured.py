"""Energy profiles from a few measured runs of a program's own moves: what the runs say, carried to all speed limits.

Durations come from the rule of the controller that explains the runs best (`robojoule.calibration.timing`), energies
from the nominal plant under that rule, with its figures moved by what the measured energies say (a linear step with the
priors of `robojoule.calibration.run_model`), both corrected motion by motion (`local_correction`). The last pass of
runs through all moves then sets the total of the durations, as far as its stamps are surer than what was expected. A
profile hardly reaches below the lowest speed limit at which its motion was measured: what is slower is not known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array, Index, Mask
from robojoule.calibration.local_correction import amplitude_of, correction, lasting_amplitude, open_deviation
from robojoule.calibration.run_model import body_directions, evaluate_runs, run_parameters
from robojoule.calibration.run_table import MeasuredRuns, energy_step_of
from robojoule.calibration.timing import checked_durations, fit_all
from robojoule.calibration.timing_fit import OF_STAMPS, RELATIVE_ERROR, Durations, RuleFit, best_rules, rule_scores
from robojoule.motion.path_integrals import PathIntegrals
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.enclosure import Enclosure
from robojoule.profile.sampled import sampled_profile
from robojoule.robots.controller_file import ControllerTiming

ENERGY_NOISE = 0.02  # of a measured energy
MODEL_NOISE = 0.01  # of a modelled one beside what its figures explain
MOST_DOUBT = 0.1  # of energies, however badly the rule says durations
SLOPE_SPREAD = 0.02  # of energy per e-fold of duration, of friction in another form than the model's
BELOW_MEASURED = 0.85  # of the lowest measured speed limit: how far below it a profile reaches
_NODES = 14
_LEAST_WEIGHT = 0.01


@dataclass(frozen=True, eq=False)
class MeasuredProfiles:
    """Durations and energies of M motions at S speed limits by measured runs (a `ProfileSource`); immutable.

    Attributes:
        speed_limits: Rising, shape (S,). [-]
        allowed: Where a motion's own runs reach, shape (M, S).
        duration_s: Shape (M, S); 0 for motions of zero length. [s]
        duration_deviation_s: What a motion's duration may be off beside what all share, shape (M, S). [s]
        lasting_deviation_s: The part of it that is the same at every run at a speed limit, and no other motion's or
            speed limit's, shape (M, S). [s]
        duration_gradient_s: Derivatives of durations after the entries of the controller's rule, shape (M, S, P). [s]
        timing_covariance: Covariance of these entries, shape (P, P).
        last_pass: Speed limit of each motion in the last pass, as a place in `speed_limits`; none: no pass, shape (M,).
        total_deviation_s: Standard deviation of the total duration of that pass. [s]
        energy_j: Shape (M, S). [J]
        energy_deviation_j: What a motion's energy may be off beside what all share, shape (M, S). [J]
        energy_gradient_j: Derivatives of energies after the unknowns of the plant, shape (M, S, Q). [J]
        energy_covariance: Covariance of these unknowns, shape (Q, Q).
        idle_w: Idle power at start and end of each motion, shape (M, 2). [W]
        idle_gradient_w: Derivatives of the idle powers after the unknowns, shape (M, 2, Q). [W]
        held_out_error: Error of durations by the rule, each motion left out in turn, relative. [-]
        controller: The controller's timing as it was found.
        rule: Name of its rule.
    """

    speed_limits: Array
    allowed: Mask
    duration_s: Array
    duration_deviation_s: Array
    lasting_deviation_s: Array
    duration_gradient_s: Array
    timing_covariance: Array
    last_pass: Index | None
    total_deviation_s: float
    energy_j: Array
    energy_deviation_j: Array
    energy_gradient_j: Array
    energy_covariance: Array
    idle_w: Array
    idle_gradient_w: Array
    held_out_error: float
    controller: ControllerTiming
    rule: str

    @property
    def idle_start_w(self) -> Array:
        """Idle power at the start of each motion, shape (M,). [W]"""
        return self.idle_w[:, 0]

    @property
    def idle_end_w(self) -> Array:
        """Idle power at the end of each motion, shape (M,). [W]"""
        return self.idle_w[:, 1]

    def enclosure(self, motion: int) -> Enclosure:
        """The profile of a motion as far as its runs reach: all that is known of it."""
        known = self.allowed[motion]
        runs = sampled_profile(self.duration_s[motion][known], self.energy_j[motion][known], self.speed_limits[known])
        return Enclosure.exact(runs.piecewise())

    def refine_near(self, durations_s: Mapping[int, Array]) -> list[int]:
        """Runs know no more than they say; see `ProfileSource.refine_near`."""
        return []

    def at(self, limits: Array) -> tuple[Array, Array]:
        """Durations [s] and energies [J] at one speed limit of each motion, shape (M,); linear between those known."""
        logs = np.log(self.speed_limits)
        pairs = list(enumerate(np.log(limits).tolist()))
        durations, energies = (
            np.array([np.interp(at, logs, table[motion]) for motion, at in pairs])
            for table in (self.duration_s, self.energy_j)
        )
        return durations, energies

    def single_deviations_s(self, motion: int) -> Array:
        """Standard deviations of the durations of one motion, shape (S,). [s]"""
        along = self.duration_gradient_s[motion]
        shared = np.einsum("sp,pq,sq->s", along, self.timing_covariance, along)
        return np.asarray(np.sqrt(np.maximum(shared, 0.0) + self.duration_deviation_s[motion] ** 2))

    def cycle_deviation_s(self, places: Index) -> float:
        """Standard deviation of the total duration of motions at places in `speed_limits`, shape (M,). [s]

        What the last pass has shown is taken away: its total is known but for the resolution of its stamps.
        """
        rows = np.arange(len(places))
        along = self.duration_gradient_s[rows, places].sum(axis=0)
        single = self.duration_deviation_s[rows, places] ** 2
        known = 0.0
        if self.last_pass is not None:
            at = self.duration_gradient_s[rows, self.last_pass].sum(axis=0)
            scale = self.duration_s[rows, places].sum() / self.duration_s[rows, self.last_pass].sum()
            along = along - scale * at
            single = np.where(self.last_pass == places, 0.0, single)
            known = (scale * self.total_deviation_s) ** 2
        shared = max(float(along @ self.timing_covariance @ along), 0.0)
        return float(np.sqrt(shared + single.sum() + known))


def measured_profiles(paths: MotionPaths, runs: MeasuredRuns, speed_limits: Array) -> MeasuredProfiles:
    """Profiles of motions from measured runs.

    Args:
        paths: The motions of the nominal robot.
        runs: Runs of these motions.
        speed_limits: Speed limits that the controller takes, rising, shape (S,). [-]

    Raises:
        InputError: The runs cannot be of these motions; see `robojoule.calibration.run_checks`.
    """
    durations = checked_durations(paths, runs)
    fits = fit_all(paths, durations, one_speed=np.unique(runs.speed_limits).size == 1)
    return Measurement(paths).profiles(runs, durations, fits, 0, speed_limits)


class Measurement:
    """Motions made ready for one or many sets of runs of them.

    Args:
        paths: The motions of the nominal robot.
        directions: Its inertial directions, shape (10 n, r); found if not given.
    """

    def __init__(self, paths: MotionPaths, directions: Array | None = None) -> None:
        self.paths = paths
        self.directions = body_directions(paths.robot) if directions is None else directions
        self.vector = run_parameters(paths.robot.drives, self.directions)
        self._regressed = PathIntegrals(paths, np.ones(1), self.directions)

    def profiles(
        self, runs: MeasuredRuns, durations: Durations, fits: Sequence[RuleFit], place: int, speed_limits: Array
    ) -> MeasuredProfiles:
        """Profiles from one set of runs and the rules that were fitted to it.

        Args:
            runs: The runs.
            durations: Their durations, of many sets.
            fits: The rules, fitted to many sets; durations are means by how probable each is.
            place: Which of the sets.
            speed_limits: Speed limits asked for, rising, shape (S,). [-]
        """
        fit = fits[int(best_rules(fits)[place])]
        candidate, x = fit.candidate, fit.x[place]
        grid, moving = speed_limits, self.paths.moving
        every = np.repeat(np.arange(self.paths.motions), grid.size)
        at_grid, at_runs = (every, np.tile(grid, self.paths.motions)), (runs.motion, runs.speed_limits)
        duration, gradient, modelled = _averaged(fits, place, at_grid, at_runs)
        duration = duration.reshape(-1, grid.size)
        gradient = gradient.reshape(*duration.shape, -1)
        covariance = np.eye(gradient.shape[2])
        covariance[: x.size, : x.size] = fit.covariance[place]

        noise = durations.deviation_s[place] / runs.duration_s
        residual = np.log(runs.duration_s / modelled)
        amplitude = amplitude_of(residual, noise, _inflation(fit, place))
        mean, deviation = correction(
            runs.motion, runs.speed_limits, residual, noise, grid, self.paths.motions, amplitude
        )
        stamps = OF_STAMPS * runs.resolution_s / runs.duration_s
        lasting = lasting_amplitude(residual, stamps, float(fit.freedom[place]), RELATIVE_ERROR)
        at = runs.motion, np.argmin(np.abs(grid - runs.speed_limits[:, None]), axis=1)
        not_run = open_deviation(at, stamps, lasting, deviation.shape)
        deviation = np.hypot(deviation, not_run)
        duration *= np.exp(mean)
        last = last_pass(runs, moving)
        total_deviation = OF_STAMPS * runs.resolution_s
        places = None
        if last is not None:
            places = np.full(self.paths.motions, grid.size - 1)
            places[runs.motion[last]] = at[1][last]
            total_s = float(_at_limits(grid, duration, runs, last).sum())
            rows = np.arange(self.paths.motions)
            along = gradient[rows, places].sum(axis=0)
            single = np.where(moving, duration[rows, places] * deviation[rows, places], 0.0)
            before = max(float(along @ covariance @ along), 0.0) + float((single**2).sum())
            share = before / (before + total_deviation**2)  # of what was measured against what was expected
            duration *= 1.0 + share * (float(runs.duration_s[last].sum()) / total_s - 1.0)
            total_deviation *= np.sqrt(share)
        duration[~moving] = 0.0
        lowest = np.full(self.paths.motions, np.inf)
        np.minimum.at(lowest, runs.motion, runs.speed_limits)
        lowest[np.isinf(lowest)] = runs.speed_limits.min()  # a motion without runs goes by those of the others
        error = float(fit.held_out_error(durations)[place])
        controller = candidate.timing(x, error)
        energies = self._energies(runs, controller, grid, duration)
        return MeasuredProfiles(
            speed_limits=grid,
            allowed=np.where(moving[:, None], grid >= BELOW_MEASURED * lowest[:, None] - 1e-9, grid == grid[-1]),
            duration_s=duration,
            duration_deviation_s=np.where(moving[:, None], duration * deviation, 0.0),
            lasting_deviation_s=duration * not_run,
            duration_gradient_s=gradient,
            timing_covariance=covariance,
            held_out_error=error,
            last_pass=places,
            total_deviation_s=total_deviation,
            controller=controller,
            rule=candidate.name,
            **energies,
        )

    def _energies(
        self, runs: MeasuredRuns, controller: ControllerTiming, grid: Array, duration_s: Array
    ) -> dict[str, Array]:
        """The fields of `MeasuredProfiles` that are about energies."""
        from scipy.interpolate import PchipInterpolator  # late: plans on simulated profiles do without

        paths, vector = self.paths.with_controller(controller), self.vector
        low = min(float(grid[0]), float(runs.speed_limits.min()))
        nodes = np.exp(np.linspace(np.log(min(low, 0.999)), 0.0, _NODES))
        integrals = PathIntegrals(paths, nodes, self.directions, self._regressed)
        start = np.concatenate([part.start for part in vector.groups] + [np.zeros(self.directions.shape[1])])
        found = evaluate_runs(vector, integrals, start)
        prior = vector.prior().covariance
        law_s = np.where(paths.moving[:, None], integrals.duration_s, 1.0)
        slope = found.energy_j * np.log(law_s / law_s[:, -1:])
        full = np.concatenate(
            [law_s[..., None], found.energy_j[..., None], found.energy_jacobian, slope[..., None]], axis=2
        )
        curves = PchipInterpolator(np.log(nodes), full, axis=1)
        fine = curves(np.log(grid))
        # What a motion takes longer than its law, or less, is taken at the power of an arm that stands by.
        active_w = vector.nominal.base_power_w + vector.nominal.drive_active_power_w
        energy, jacobian = fine[..., 1] + active_w * (duration_s - fine[..., 0]), fine[..., 2:]
        energy[~paths.moving] = 0.0
        covariance = np.zeros((jacobian.shape[2],) * 2)
        covariance[:-1, :-1] = prior
        covariance[-1, -1] = SLOPE_SPREAD**2
        idle = found.idle_w
        idle_jacobian = np.concatenate([found.idle_jacobian, np.zeros((*idle.shape, 1))], axis=2)
        deviation = np.zeros_like(energy)
        known = np.flatnonzero(np.isfinite(runs.energy_j))
        if known.size:
            motion, limits = runs.motion[known], runs.speed_limits[known]
            at = np.stack([curves(np.log(p))[m] for m, p in zip(motion.tolist(), limits.tolist(), strict=True)])
            model, along = at[:, 1] + active_w * (runs.duration_s[known] - at[:, 0]), at[:, 2:]
            # Where the rule misses durations, it misses accelerations, and energies with them.
            doubt = float(np.linalg.norm([ENERGY_NOISE, MODEL_NOISE, min(controller.duration_error, MOST_DOUBT)]))
            stepped = OF_STAMPS * energy_step_of(runs.energy_j) / np.abs(model)  # of a meter: two readings a run
            noise = np.hypot(doubt, stepped)
            scaled = along / model[:, None]
            residual = runs.energy_j[known] / model - 1.0
            across = covariance @ scaled.T
            inner = scaled @ across + np.diag(noise**2)
            gain = np.linalg.solve(inner, across.T).T
            step = gain @ residual
            covariance = covariance - gain @ across.T
            left = np.log(np.maximum(runs.energy_j[known] / np.maximum(model + along @ step, 1e-9), 1e-9))
            noises = np.hypot(ENERGY_NOISE, stepped)
            told = noises <= 2.0 * noises.min()  # what a meter hardly sees says nothing of what all moves have
            amplitude = amplitude_of(left[told], noises[told])
            mean, spread = correction(motion, limits, left, noises, grid, paths.motions, amplitude)
            energy = (energy + jacobian @ step) * np.exp(mean)
            jacobian = jacobian * np.exp(mean)[..., None]
            deviation = energy * spread
            idle = idle + idle_jacobian @ step
        return {
            "energy_j": energy,
            "energy_deviation_j": deviation,
            "energy_gradient_j": jacobian,
            "energy_covariance": covariance,
            "idle_w": idle,
            "idle_gradient_w": idle_jacobian,
        }


def _averaged(
    fits: Sequence[RuleFit], place: int, at_grid: tuple[Index, Array], at_runs: tuple[Index, Array]
) -> tuple[Array, Array, Array]:
    """Durations by all rules that are probable, as means of their logarithms.

    Args:
        fits: The rules.
        place: Which set of runs.
        at_grid: Motions and speed limits asked for, shape (G,) each.
        at_runs: Those of the runs, shape (R,) each.

    Returns:
        Durations (G,) [s]; their derivatives after the entries of the best rule and, with variance 1, after what
        rules differ by (G, P + k); durations of the runs (R,) [s].
    """
    scores = rule_scores(fits)[:, place]
    weights = np.exp(scores.min() - scores)
    weights /= weights.sum()
    kept = np.flatnonzero(weights > _LEAST_WEIGHT)
    weights = weights[kept] / weights[kept].sum()
    best = int(np.argmin(scores))
    tables, runs, gradient = [], [], np.zeros(0)
    for number in kept.tolist():
        candidate, x = fits[number].candidate, fits[number].x[place][None]
        found, along = candidate.evaluate(x, at_grid[0], at_grid[1][None])
        tables.append(np.log(found[0]))
        runs.append(np.log(candidate.evaluate(x, at_runs[0], at_runs[1][None])[0][0]))
        if number == best:
            gradient = along[0]
    logs = np.stack(tables)
    mean = np.exp(weights @ logs)
    if kept.size > 1:
        apart = (logs - weights @ logs) * np.sqrt(weights)[:, None] * mean
        gradient = np.concatenate([gradient, apart.T], axis=1)
    return mean, gradient, np.exp(weights @ np.stack(runs))


def last_pass(runs: MeasuredRuns, moving: Mask) -> Index | None:
    """Rows of the last pass through all moves that move, in their order, shape (M',); None if the last are none."""
    count = int(moving.sum())
    rows = np.arange(runs.motion.size - count, runs.motion.size)
    if count == 0 or rows[0] < 0 or not np.array_equal(runs.motion[rows], np.flatnonzero(moving)):
        return None
    return rows


def _at_limits(grid: Array, table: Array, runs: MeasuredRuns, rows: Index | slice) -> Array:
    """A table over motions and speed limits, shape (M, S), at runs; linear between speed limits."""
    logs = np.log(grid)
    pairs = zip(runs.motion[rows].tolist(), np.log(runs.speed_limits[rows]).tolist(), strict=True)
    return np.array([np.interp(at, logs, table[motion]) for motion, at in pairs])


def _inflation(fit: RuleFit, place: int) -> float:
    """By how much residuals count for more where their rule misses motions left out by more than noise. [-]"""
    return 1.0 if fit.excess[place] <= 1.0 else 1.5
