"""The timing of a controller from durations of motions at known speed limits: rule, figures and how sure they are."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.run_checks import check_runs
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.calibration.timing_fit import OF_STAMPS, Durations, RuleFit, best_rules, fit_rule, rule_scores
from robojoule.calibration.timing_rules import JOINT_VELOCITY_SPREAD, OWN, Candidate, candidates
from robojoule.documents import parse
from robojoule.errors import InputError
from robojoule.inputs import counted
from robojoule.motion.simulation import MotionPaths
from robojoule.robots.controller_file import ControllerTiming
from robojoule.robots.robot import Robot
from robojoule.robots.robot_file import RobotFile

FEWEST_MOTIONS = 3
IDENTIFIED = 0.5  # of the deviation before the runs: a figure that they tell
POOR_ERROR_PERCENT = 3.0
_SIGNIFICANT_DIGITS = 6


@dataclass(frozen=True)
class TimingParameter:
    """One figure of a controller.

    Attributes:
        name: Key in the robot file's `controller` section; `joints.velocity_rad_s` and `joints.acceleration_rad_s2` are
            those of all joints alike.
        unit: Its unit.
        value: Estimate.
        standard_error: Its standard error, as far as the runs and what was known before tell.
        before: What was expected before the runs.
        identified: Whether the runs tell it; else the value is mostly what was expected.
    """

    name: str
    unit: str
    value: float
    standard_error: float
    before: float
    identified: bool


@dataclass(frozen=True)
class RuleScore:
    """How well a rule says durations of motions that it was not fitted to.

    Attributes:
        name: The rule.
        held_out_error_percent: Root mean square error of durations, each motion left out in turn. [%]
        log_probability: Logarithm of the probability of these durations, relative to the rule that was chosen.
    """

    name: str
    held_out_error_percent: float
    log_probability: float


@dataclass(frozen=True, eq=False)
class TimingIdentification:
    """What measured durations tell of a controller's timing.

    Attributes:
        robot: Robot that the fit started from.
        source: Where the runs come from.
        rule: The rule that was chosen.
        rules: All rules that took part, best first.
        parameters: Its figures; none where it is the entry's own.
        controller: The same, ready for motions.
        held_out_error_percent: Error of the rule, each motion left out in turn. [%]
        nominal_error_percent: Error of the entry's own timing. [%]
        resolution_s: Step in which instants were taken down. [s]
        rounding_percent: What that step alone makes of the durations' errors. [%]
        runs: Number of runs.
        motions: Number of different motions.
        speeds: Number of different speed limits.
    """

    robot: Robot
    source: str
    rule: str
    rules: tuple[RuleScore, ...]
    parameters: tuple[TimingParameter, ...]
    controller: ControllerTiming
    held_out_error_percent: float
    nominal_error_percent: float
    resolution_s: float
    rounding_percent: float
    runs: int
    motions: int
    speeds: int

    def __repr__(self) -> str:
        return (
            f"TimingIdentification({self.robot.name!r} from {self.source!r}: {self.rule}, "
            f"held_out_error_percent={self.held_out_error_percent:.3g}, before={self.nominal_error_percent:.3g})"
        )

    @property
    def unidentified(self) -> tuple[TimingParameter, ...]:
        """Figures that the runs do not tell."""
        return tuple(parameter for parameter in self.parameters if not parameter.identified)

    @property
    def is_good(self) -> bool:
        """Whether the rule explains the durations, and better than the entry: else robot files keep the entry's."""
        if self.rule == OWN:
            return False
        return self.held_out_error_percent <= min(self.poor_error_percent, self.nominal_error_percent)

    @property
    def poor_error_percent(self) -> float:
        """Error of motions left out above which a rule does not explain durations that were taken down so. [%]"""
        return _poor_error_percent(self.rounding_percent / 100.0)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know before the figures are used, a sentence each."""
        found = []
        if self.held_out_error_percent > self.poor_error_percent:
            found.append(
                f"no rule explains the durations to {self.poor_error_percent:.2g} % of motions left out, so none is "
                "taken: check speed limits (column speed_limit_percent), payload and that every move stops at its end"
            )
        elif not self.is_good:
            found.append("the entry's own timing meets the runs as well as any rule, so it is kept")
        if self.speeds == 1:
            found.append(
                "all runs have one speed limit: how accelerations change with it is not known, and slower runs are a "
                "guess"
            )
        return tuple(found)

    def to_dict(self) -> dict[str, Any]:
        """Rule, figures and errors as plain data, ready for JSON."""
        errors = ("held_out_error_percent", "nominal_error_percent", "rounding_percent")
        names = ("source", "rule", *errors, "resolution_s")
        return {
            **{name: getattr(self, name) for name in names},
            "runs": self.runs,
            "motions": self.motions,
            "speeds": self.speeds,
            "rules": [asdict(rule) for rule in self.rules],
            "parameters": [asdict(parameter) for parameter in self.parameters],
            "unidentified": [parameter.name for parameter in self.unidentified],
            "warnings": list(self.warnings),
        }

    def controller_data(self) -> dict[str, Any]:
        """The `controller` section of a robot file."""
        found = self.controller
        accelerations = found.acceleration_rad_s2
        joints: dict[str, dict[str, float]] = {}
        for place, name in enumerate(self.robot.joint_names):
            joints[name] = {"velocity_rad_s": _rounded(found.velocity_rad_s[place])}
            if accelerations is not None:
                joints[name]["acceleration_rad_s2"] = _rounded(accelerations[place])
        kept = ", ".join(parameter.name for parameter in self.unidentified) or "none"
        return {
            "provenance": (
                f"identified from {counted(self.runs, 'run')} of {counted(self.motions, 'motion')} in "
                f"{Path(self.source).name}: motions left out are met to {self.held_out_error_percent:.2g} % (before: "
                f"{self.nominal_error_percent:.2g} %). Not told by the runs: {kept}."
            ),
            "rule": found.rule,
            "acceleration_factor": _rounded(found.acceleration_factor),
            "acceleration_exponent": _rounded(found.acceleration_exponent),
            "filter_time_s": _rounded(found.filter_time_s),
            "dead_time_s": _rounded(found.dead_time_s),
            "least_cruise_share": found.least_cruise_share,
            "duration_error_percent": _rounded(100.0 * found.duration_error),
            "joints": joints,
        }

    def robot_file(self, name: str | None = None) -> RobotFile:
        """The robot file with the identified timing.

        Args:
            name: Name of the new entry (default: the robot's name with `_identified`).
        """
        return with_timing(self.robot.file, self, name)


def timing_warnings(timing: TimingIdentification | None, no_timing: str | None) -> tuple[str, ...]:
    """What to know about the timing of a log's motions, a sentence each: why there is none, or its warnings."""
    if timing is not None:
        return timing.warnings
    return () if no_timing is None else (no_timing,)


def with_timing(file: RobotFile, timing: TimingIdentification | None, name: str | None) -> RobotFile:
    """A robot file with an identified timing, if there is one, and a name of its own.

    Args:
        file: File that it builds on, whose programs the new entry takes.
        timing: What was identified.
        name: Name of the new entry; that of the old one with `_identified` if not given.
    """
    data = file.model_dump(mode="json")
    data["derived_from"] = file.derived_from or file.name
    data["name"] = name if name is not None else f"{file.name}_identified"
    if timing is not None and timing.is_good:
        data["controller"] = timing.controller_data()
    return parse(RobotFile, data, f"identified {file.name}")


def _rounded(value: float) -> float:
    return float(f"{value:.{_SIGNIFICANT_DIGITS}g}")


def identify_timing(paths: MotionPaths, runs: MeasuredRuns) -> TimingIdentification:
    """Choose and fit the rule that says durations of motions left out best.

    Args:
        paths: The motions by the nominal controller.
        runs: Their measured runs.

    Raises:
        InputError: Too few motions, or runs that cannot be of them.
    """
    durations = checked_durations(paths, runs)
    motions = int(np.unique(runs.motion).size)
    if motions < FEWEST_MOTIONS:
        problem = f"the runs are of {counted(motions, 'motion')} only"
        raise InputError(problem, file=runs.source, allowed=f"at least {FEWEST_MOTIONS} different motions")
    speeds = int(np.unique(runs.speed_limits).size)
    fits = fit_all(paths, durations, one_speed=speeds == 1)
    scores = rule_scores(fits)[:, 0]
    chosen = fits[int(best_rules(fits)[0])]
    error = float(chosen.held_out_error(durations)[0])
    nominal = nominal_durations(paths, runs)
    return TimingIdentification(
        robot=paths.robot,
        source=runs.source,
        rule=chosen.candidate.name,
        rules=tuple(
            RuleScore(
                fit.candidate.name,
                100.0 * float(fit.held_out_error(durations)[0]),
                float(scores.min() - scores[place]),
            )
            for place in np.argsort(scores, kind="stable").tolist()
            if np.isfinite(scores[place])
            for fit in [fits[place]]
        ),
        parameters=tuple(_parameters(chosen, paths.robot)),
        controller=chosen.candidate.timing(chosen.x[0], error),
        held_out_error_percent=100.0 * error,
        nominal_error_percent=100.0 * float(np.sqrt(np.mean((nominal / runs.duration_s - 1.0) ** 2))),
        resolution_s=runs.resolution_s,
        rounding_percent=100.0 * rounding_error(runs),
        runs=runs.motion.size,
        motions=motions,
        speeds=speeds,
    )


def checked_durations(paths: MotionPaths, runs: MeasuredRuns) -> Durations:
    """Durations of runs as one data set.

    Raises:
        InputError: The runs cannot be of these motions; see `robojoule.calibration.run_checks`.
    """
    check_runs(paths, runs)
    return Durations.of(runs.motion, runs.speed_limits[None], runs.duration_s[None], runs.resolution_s)


def rounding_error(runs: MeasuredRuns) -> float:
    """Root mean square of what the clock's step alone makes of the durations' relative errors. [-]"""
    return OF_STAMPS * runs.resolution_s * math.sqrt(float(np.mean(runs.duration_s**-2.0)))


def _poor_error_percent(rounding: float) -> float:
    """Error of motions left out above which a rule does not explain durations with such a rounding error [-]. [%]"""
    return math.hypot(POOR_ERROR_PERCENT, 100.0 * rounding)


def rule_doubts(error: float, runs: MeasuredRuns) -> tuple[str, ...]:
    """What to know where the rule misses motions left out by more than the clock explains, a sentence each.

    Args:
        error: Of the rule, each motion left out in turn, relative. [-]
        runs: The runs that it was fitted to.
    """
    if not 100.0 * error > _poor_error_percent(rounding_error(runs)):
        return ()
    return (
        f"no rule of a controller explains the runs: durations of motions left out are missed by {100.0 * error:.0f} "
        "%, so speed limits that were not measured are guesses; check the order of moves, speed limits, payload and "
        "that every move stops at its end",
    )


def fit_all(paths: MotionPaths, durations: Durations, *, one_speed: bool) -> list[RuleFit]:
    """All rules fitted; where all runs have one speed limit, accelerations are taken as the same at every one."""
    fits = candidates(paths, (0.0,)) if one_speed else candidates(paths)
    return [fit_rule(candidate, durations) for candidate in fits]


def nominal_durations(paths: MotionPaths, runs: MeasuredRuns) -> Array:
    """Durations of runs by the timing that the paths have, shape (R,). [s]"""
    limits = np.unique(runs.speed_limits)
    table = paths.durations(limits)
    return np.asarray(table[runs.motion, np.searchsorted(limits, runs.speed_limits)])


def _parameters(fit: RuleFit, robot: Robot) -> list[TimingParameter]:
    candidate, x, covariance = fit.candidate, fit.x[0], fit.covariance[0]
    if candidate.is_own:
        return []
    prior = np.diag(candidate.spread**2)
    found = []

    def add(name: str, unit: str, along: Array, least_error: float | None = None, *, log: bool = True) -> None:
        deviation, expected = np.sqrt(along @ covariance @ along), np.sqrt(along @ prior @ along)
        value, before = along @ x, along @ candidate.mean
        if log:
            value, before = np.exp(value), np.exp(before)
        found.append(
            TimingParameter(
                name=name,
                unit=unit,
                value=float(value),
                standard_error=float(deviation * value if log else deviation),
                before=float(before),
                identified=bool(deviation < (IDENTIFIED * expected if least_error is None else least_error)),
            )
        )

    shared = candidate.rule == "leading_axis"
    for place, joint in enumerate(robot.joint_names[:1] if shared else robot.joint_names):
        key = "joints" if shared else f"joints.{joint}"
        # A joint that binds nowhere is known as well as all joints together, by assumption: that does not count.
        least = None if shared else IDENTIFIED * JOINT_VELOCITY_SPREAD
        add(f"{key}.velocity_rad_s", "rad/s", candidate.velocity[place], least)
        if candidate.rule != "torque_limited":
            add(f"{key}.acceleration_rad_s2", "rad/s2", candidate.acceleration[place])
    if candidate.rule == "torque_limited":
        add("acceleration_factor", "1", _unit(candidate, "acceleration_factor"))
    if candidate.exponent is None:
        add("acceleration_exponent", "1", _unit(candidate, "exponent"), log=False)
    add("filter_time_s", "s", _unit(candidate, "filter_time_s"))
    add("dead_time_s", "s", _unit(candidate, "dead_time_s"), log=False)
    return found


def _unit(candidate: Candidate, entry: str) -> Array:
    return np.asarray(np.eye(len(candidate.mean))[candidate.at(entry)])
