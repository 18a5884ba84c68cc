"""Identify a robot's drives from a log: fit, judge on held-out motions, write a robot file."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student_t

from robojoule.arrays import Array, Mask, freeze
from robojoule.calibration.lag import MeterLag
from robojoule.calibration.log import MeasuredLog
from robojoule.calibration.log_checks import check_load, check_power, check_torque
from robojoule.calibration.log_fit import Solution, solve
from robojoule.calibration.log_model import evaluate, log_parameters
from robojoule.calibration.parameters import ParameterVector
from robojoule.calibration.payload_check import payload_that_fits
from robojoule.calibration.signals import WINDOW_S, Signals, prepare
from robojoule.calibration.timing import TimingIdentification, timing_warnings, with_timing
from robojoule.documents import parse
from robojoule.errors import InputError
from robojoule.inputs import shown
from robojoule.robots.robot import Robot
from robojoule.robots.robot_file import RobotFile

UNITS = {
    "base_power_w": "W",
    "drive_active_power_w": "W",
    "inverter_efficiency": "1",
    "regeneration_efficiency": "1",
    "coulomb_nm": "Nm",
    "viscous_nm_s_per_rad": "Nm s/rad",
    "copper_w_per_nm2": "W/Nm2",
}
POOR_R2 = 0.9  # of held-out motions; logs that the model explains reach 0.97 and more
FEW_MOTIONS = 8  # below it people are told
PowerSide = Literal["mains", "arm"]
_SIDED = ("base_power_w", "drive_active_power_w", "inverter_efficiency")  # differ between mains and arm
_SIGNIFICANT_DIGITS = 6


@dataclass(frozen=True)
class Parameter:
    """One parameter of the drives.

    Attributes:
        name: Key in the robot file's `drives` section.
        unit: Its unit.
        value: Estimate, or the catalog's value where the log does not determine it.
        standard_error: Standard error of the estimate; None if the catalog's value was kept.
        inertia_error: How far the estimate may be off because each body's inertia is known to 5 % only; None if the
            catalog's value was kept.
        catalog_value: The catalog's value.
        identified: Whether the log determines it.
        confounded_with: If not: the parameters from which the log cannot tell it (empty: too little depends on it).
        at_bound: Whether the estimate lies at a physical bound.
    """

    name: str
    unit: str
    value: float
    standard_error: float | None
    inertia_error: float | None
    catalog_value: float
    identified: bool
    confounded_with: tuple[str, ...]
    at_bound: bool


@dataclass(frozen=True)
class Score:
    """Agreement of measured and modelled power over windows of a part of the log.

    Attributes:
        motions: Number of blocks (motions with their rests).
        duration_s: Their length. [s]
        r2: Coefficient of determination of the windows' mean power. [-]
        rmse_w: Root mean square error of the windows' mean power. [W]
        rmse_percent: The same over the mean power. [%]
        energy_error_percent: Error of the summed energy. [%]
        motion_energy_error_percent: Mean absolute error of the blocks' energies. [%]
    """

    motions: int
    duration_s: float
    r2: float
    rmse_w: float
    rmse_percent: float
    energy_error_percent: float
    motion_energy_error_percent: float


@dataclass(frozen=True, eq=False)
class Identification:
    """What a log tells about a robot's drives.

    Attributes:
        robot: Robot that the fit started from.
        source: The log.
        parameters: All parameters.
        training: Score on the windows that were fitted.
        held_out: Score on the windows that took no part.
        held_out_catalog: The same with the catalog's parameters, for comparison.
        braking_share: Share of time in which the bus had a surplus. [-]
        smoothing_s: Length over which positions were differentiated. [s]
        with_torque: Whether measured torques were used.
        power_side: Where power was measured: at the mains, or on the bus of the arm, from which the figures are seen.
        interpolated_step_s: Median step of the log, if positions between its samples are interpolated. [s]
        window_time_s: Middle of each window, shape (W,). [s]
        measured_w: Measured mean power of each window, shape (W,). [W]
        modelled_w: Modelled mean power of each window, shape (W,). [W]
        window_held_out: Which windows took no part in the fit, shape (W,).
        payload_that_fits_kg: Payload that explains the log clearly better than the given one; None where that fits.
        lag: How late the meter was against the positions, which was put right before the fit; None if not looked for.
        timing: The controller's timing by the log's motions, if they tell it.
        no_timing: Why they do not tell it, a sentence.
        log_warnings: What to know about the log itself, a sentence each.
    """

    robot: Robot
    source: str
    parameters: tuple[Parameter, ...]
    training: Score
    held_out: Score
    held_out_catalog: Score
    braking_share: float
    smoothing_s: float
    with_torque: bool
    power_side: PowerSide
    interpolated_step_s: float | None
    window_time_s: Array
    measured_w: Array
    modelled_w: Array
    window_held_out: Mask
    payload_that_fits_kg: float | None = None
    lag: MeterLag | None = None
    timing: TimingIdentification | None = None
    no_timing: str | None = None
    log_warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze(self)

    def __repr__(self) -> str:
        found = len(self.parameters) - len(self.unidentified)
        return (
            f"Identification({self.robot.name!r} from {self.source!r}: parameters={found} of {len(self.parameters)}, "
            f"held-out r2={self.held_out.r2:.4f}, rmse_percent={self.held_out.rmse_percent:.3g})"
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know before the figures are used, a sentence each."""
        found = [*self.log_warnings]
        if self.held_out.r2 < POOR_R2:
            found.append(
                f"poor fit (R2 below {POOR_R2:g}): the energy model does not explain this log; "
                "check that power and positions share one clock, and robot, payload and units"
            )
        if self.interpolated_step_s is not None:
            found.append(
                f"samples are {1e3 * self.interpolated_step_s:.0f} ms apart or some are missing: positions and "
                "velocities between them are interpolated"
            )
        if self.lag is not None and self.lag.lag_s != 0.0:
            found.append(
                f"the power comes {1e3 * abs(self.lag.lag_s):.0f} ms {'later' if self.lag.lag_s > 0.0 else 'earlier'} "
                "than the positions: it was moved before the fit"
            )
        if self.payload_that_fits_kg is not None:
            found.append(
                f"the log looks like a payload of about {self.payload_that_fits_kg:.1f} kg, not of "
                f"{self.robot.payload.mass_kg:g} kg: friction and losses stand in for the difference"
            )
        motions = self.training.motions + self.held_out.motions
        if motions < FEW_MOTIONS:
            found.append(f"the log holds only {motions} motions: errors are wide, and scores stand on few of them")
        return (*found, *timing_warnings(self.timing, self.no_timing))

    def to_dict(self) -> dict[str, Any]:
        """Parameters and scores as plain data, ready for JSON."""
        return {
            "robot": self.robot.name,
            "payload_kg": float(self.robot.payload.mass_kg),
            "log": self.source,
            "smoothing_s": self.smoothing_s,
            "with_torque": self.with_torque,
            "power_side": self.power_side,
            "interpolated_step_s": self.interpolated_step_s,
            "braking_share": self.braking_share,
            "parameters": [asdict(parameter) for parameter in self.parameters],
            "unidentified": [parameter.name for parameter in self.unidentified],
            "training": asdict(self.training),
            "held_out": asdict(self.held_out),
            "held_out_catalog": asdict(self.held_out_catalog),
            "payload_that_fits_kg": self.payload_that_fits_kg,
            "lag_s": None if self.lag is None else self.lag.lag_s,
            "timing": None if self.timing is None else self.timing.to_dict(),
            "warnings": list(self.warnings),
        }

    @property
    def unidentified(self) -> tuple[Parameter, ...]:
        """Parameters that keep the catalog's value."""
        return tuple(parameter for parameter in self.parameters if not parameter.identified)

    def robot_file(self, name: str | None = None) -> RobotFile:
        """The robot file with the identified drives.

        Args:
            name: Name of the new entry (default: the robot's name with `_identified`).
        """
        data = with_timing(self.robot.file, self.timing, name).model_dump(mode="json")
        drives = data["drives"]
        drives["provenance"] = self.provenance()
        data["provenance"]["drives"] = {
            "kind": "identified",
            "note": f"from the log {Path(self.source).name}; see drives.provenance",
        }
        keys = log_parameters(self.robot).keys(self.robot.joint_names)
        for parameter, (*path, key) in zip(self.parameters, keys, strict=True):
            target = drives
            for part in path:
                target = target[part]
            if parameter.identified:  # the others keep the file's figure to the last digit
                target[key] = float(f"{parameter.value:.{_SIGNIFICANT_DIGITS}g}")
        if self.power_side == "arm" and self.robot.supply is not None:
            found: dict[str, Any] = {p.name: p.value for p in self.parameters if p.name in _SIDED}
            mains = self.robot.supply.mains_side(replace(self.robot.drives, **found))
            drives |= {name: float(f"{getattr(mains, name):.{_SIGNIFICANT_DIGITS}g}") for name in _SIDED}
        elif (supply := self.robot.supply) is not None and (
            supply.controller_power_w > drives["base_power_w"] or supply.efficiency < drives["inverter_efficiency"]
        ):  # the machine is better than what was assumed to lie before its arm
            drives["supply"] = None
            data["provenance"].pop("supply", None)
        return parse(RobotFile, data, f"identified {self.robot.name}")

    def provenance(self) -> str:
        """One sentence on where the figures come from."""
        kept = ", ".join(parameter.name for parameter in self.unidentified) or "none"
        motions = self.training.motions + self.held_out.motions
        duration = self.training.duration_s + self.held_out.duration_s
        score = self.held_out
        given = "limits" if self.timing is not None and self.timing.is_good else "limits and timing"
        return (
            f"identified from the log {Path(self.source).name} ({duration:.1f} s, {motions} motions) by robust least "
            f"squares on the energy model; on {score.motions} held-out motions RMSE {score.rmse_percent:.2f} % of mean "
            f"power, R2 {score.r2:.4f}. Taken as given: link and rotor inertia, gear ratios, {given} "
            f"of {self.robot.name}, and what the log does not determine: {kept}. "
            f"Before: {self.robot.file.drives.provenance}"
        )


def identify(
    log: MeasuredLog,
    robot: Robot,
    *,
    smoothing_s: float | None = None,
    window_s: float = WINDOW_S,
    power_side: PowerSide = "mains",
) -> Identification:
    """Estimate friction, copper loss, base and active power and the efficiencies of a robot's drives.

    Args:
        log: Checked log, see `read_log`.
        robot: The robot with its payload; its link inertias, gear ratios and rotor inertias are taken as given.
        smoothing_s: Length of the stretch over which positions are differentiated; chosen from their noise if not
            given. [s]
        window_s: Length over which power is averaged. [s]
        power_side: Where power was measured: at the mains, or on the bus of the arm (`Robot.arm_side`).

    Raises:
        InputError: The log is too short or contradicts itself; positions jump; power, positions, velocities or torques
            are saturated or in a wrong unit.
    """
    if power_side not in get_args(PowerSide):
        sides = ", ".join(get_args(PowerSide))
        raise InputError(f"{shown(power_side)} is not a side of the power", key="power_side", allowed=sides)
    if power_side == "arm":
        robot = robot.arm_side()
    signals = prepare(log, robot, smoothing_s, window_s)
    check_load(signals, robot, log.source)
    vector = log_parameters(robot)
    start = np.clip(vector.start, vector.lower, vector.upper)
    check_power(log, signals, evaluate(vector, signals, start).power_w)
    check_torque(log, signals, evaluate(vector, signals, start).torque_nm)
    solution = solve(vector, signals)
    final = evaluate(vector, signals, solution.x)  # with modelled torques, as everybody else will use it
    catalog = evaluate(vector, signals, start)
    measured = signals.average(signals.power_w)
    held_out = signals.held_out
    return Identification(
        robot=robot,
        source=log.source,
        parameters=tuple(_parameters(vector, solution, robot, wider_for_few(signals.training_blocks))),
        training=_score(signals, measured, final.window_power_w, ~held_out),
        held_out=_score(signals, measured, final.window_power_w, held_out),
        held_out_catalog=_score(signals, measured, catalog.window_power_w, held_out),
        braking_share=float(signals.weight_s @ (final.bus_w < 0.0) / signals.weight_s.sum()),
        smoothing_s=signals.smoothing_s,
        with_torque=signals.torque_nm is not None,
        power_side=power_side,
        interpolated_step_s=signals.interpolated_step_s,
        window_time_s=signals.average(signals.time_s),
        measured_w=measured,
        modelled_w=final.window_power_w,
        window_held_out=held_out,
        payload_that_fits_kg=payload_that_fits(log, robot, vector, signals, solution, window_s),
        log_warnings=log.clock_warnings,
    )


def wider_for_few(blocks: int) -> float:
    """By how much errors are wider than those of many motions: the quantile of Student's t over the normal one. [-]

    Motions, not samples, are what is independent in a log.
    """
    return float(student_t.ppf(0.975, max(blocks - 1, 1)) / norm.ppf(0.975))


def _parameters(vector: ParameterVector, solution: Solution, robot: Robot, wider: float) -> list[Parameter]:
    keys = vector.keys(robot.joint_names)
    names = [".".join(key) for key in keys]
    value = vector.figures(solution.x)
    catalog = np.concatenate([np.atleast_1d(getattr(robot.drives, part.figure)) for part in vector.groups])
    scale = np.abs(vector.slopes(solution.x))  # from errors of entries to those of figures
    margin = 1e-6 * vector.scale
    at_bound = (solution.x <= vector.lower + margin) | (solution.x >= vector.upper - margin)
    return [
        Parameter(
            name=names[entry],
            unit=UNITS[key[-1]],
            value=float(value[entry] if free else catalog[entry]),
            standard_error=float(wider * scale[entry] * solution.standard_error[entry]) if free else None,
            inertia_error=float(scale[entry] * solution.inertia_error[entry]) if free else None,
            catalog_value=float(catalog[entry]),
            identified=free,
            confounded_with=tuple(names[other] for other in solution.confounded.get(entry, ())),
            at_bound=free and bool(at_bound[entry]),
        )
        for entry, (key, free) in enumerate(zip(keys, solution.free.tolist(), strict=True))
    ]


def _score(signals: Signals, measured: Array, modelled: Array, use: Mask) -> Score:
    length, m, p = signals.window_s[use], measured[use], modelled[use]
    total = float(length.sum())
    mean = float(length @ m) / total
    square = float(length @ (m - p) ** 2) / total
    blocks = np.unique(signals.window_block[use], return_inverse=True)[1]
    energy = np.bincount(blocks, length * m)
    error = np.bincount(blocks, length * (p - m))
    rmse = float(np.sqrt(square))
    return Score(
        motions=len(energy),
        duration_s=total,
        r2=1.0 - square / max(float(length @ (m - mean) ** 2) / total, 1e-12),
        rmse_w=rmse,
        rmse_percent=100.0 * rmse / mean,
        energy_error_percent=100.0 * float(error.sum()) / float(energy.sum()),
        motion_energy_error_percent=100.0 * float(np.mean(np.abs(error / energy))),
    )
