"""From a log to what the fit needs: smooth derivatives, motions, windows.

Derivatives come from local cubic least squares: round each instant a cubic is fitted to the samples within half the
smoothing time before and after it (the Savitzky-Golay filter, here for any spacing of the samples); its value, slope
and curvature at the instant are position, velocity and acceleration. Nothing is resampled. Power is averaged over
short windows, measured and modelled with the same trapezoidal weights, so that noise of single samples cancels while
energy is kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from robojoule.arrays import Array, Index, Mask
from robojoule.calibration.interpolation import interpolated, is_sparse
from robojoule.calibration.log import MeasuredLog
from robojoule.errors import InputError
from robojoule.inputs import as_number, counted
from robojoule.motion.dynamics import inverse_dynamics
from robojoule.robots.robot import Payload, Robot

WINDOW_S = 0.1
SHORTEST_LENGTH_S, LONGEST_LENGTH_S = 1e-3, 1.0  # of windows and of smoothing
LONGEST_SMOOTHING_S = 0.12
ACCELERATION_NOISE = 0.03  # of the acceleration's root mean square: what smoothing must bring the noise down to
INERTIA_UNCERTAINTY = 0.05  # relative; catalogs and CAD models are rarely better
REST_SPEED = 0.002  # of the speed limit: below it a joint stands
STOP_SPEED = 0.03  # of the speed limit: below it one motion ends and the next begins
LONGEST_BLOCK_S = 6.0
HELD_OUT_EVERY = 4  # every fourth block is held out
FEWEST_BLOCKS = 2  # one to fit, one to judge
LARGEST_VELOCITY_MISFIT = 0.1  # root mean square, of the velocity's own
_CHUNK = 20_000
_MOST_PAYLOADS = 20


@dataclass(frozen=True)
class Signals:
    """A log made ready: T instants, n joints, W windows, B blocks.

    Attributes:
        time_s: Instants, shape (T,). [s]
        velocity_rad_s: Joint velocities, exactly 0 where a joint stands, shape (T, n). [rad/s]
        direction: Sign of the velocity, 0 where a joint stands, shape (T, n). [-]
        moving: Whether any joint moves, shape (T,).
        load_nm: Rigid-body and rotor-inertia torques on the link side (no friction), shape (T, n). [Nm]
        load_change_nm: Their change if one moving body were heavier by `INERTIA_UNCERTAINTY`, shape (n, T, n). [Nm]
        smoothing_s: Length over which positions were differentiated. [s]
        torque_nm: Measured drive torques on the link side, shape (T, n), if logged. [Nm]
        power_w: Mains power, shape (T,). [W]
        weight_s: Trapezoidal weights: the share of time of each instant, shape (T,). [s]
        window_start: First instant of each window, shape (W,).
        window_s: Length of each window, shape (W,). [s]
        window_block: Block of each window, shape (W,).
        blocks: Number of blocks B. A block is one motion with half of the rests round it, or a stretch of time.
        interpolated_step_s: Median step of the log, if positions between its samples are interpolated. [s]
    """

    time_s: Array
    velocity_rad_s: Array
    direction: Array
    moving: Mask
    load_nm: Array
    load_change_nm: Array
    smoothing_s: float
    torque_nm: Array | None
    power_w: Array
    weight_s: Array
    window_start: Index
    window_s: Array
    window_block: Index
    blocks: int
    interpolated_step_s: float | None = None

    def average(self, values: Array) -> Array:
        """Average over windows, shape (T, ...) -> (W, ...)."""
        weights = self.weight_s.reshape(-1, *[1] * (values.ndim - 1))
        length = self.window_s.reshape(-1, *[1] * (values.ndim - 1))
        return np.asarray(np.add.reduceat(values * weights, self.window_start, axis=0) / length)

    @property
    def held_out(self) -> Mask:
        """Windows of the held-out blocks, shape (W,): every fourth, or the last of fewer."""
        every = min(HELD_OUT_EVERY, self.blocks)
        return np.asarray(self.window_block % every == every - 1, dtype=np.bool_)

    @property
    def training_blocks(self) -> int:
        """Number of blocks that are not held out."""
        return self.blocks - self.blocks // min(HELD_OUT_EVERY, self.blocks)


def local_cubic(time_s: Array, values: Array, smoothing_s: float) -> tuple[Array, Array, Array]:
    """Value, first and second derivative by local cubic least squares.

    Args:
        time_s: Instants, rising, shape (T,). [s]
        values: Samples, shape (T, n).
        smoothing_s: Length of the stretch that one cubic is fitted to; at least five samples. [s]

    Returns:
        Three arrays of shape (T, n).
    """
    half = max(2, round(smoothing_s / float(np.median(np.diff(time_s))) / 2.0))
    count = len(time_s)
    width = min(2 * half + 1, count)
    results = (np.empty_like(values), np.empty_like(values), np.empty_like(values))
    for begin in range(0, count, _CHUNK):
        centre = np.arange(begin, min(begin + _CHUNK, count))
        first = np.clip(centre - half, 0, count - width)  # at the ends the stretch is not centred
        index = first[:, None] + np.arange(width)
        x = time_s[index] - time_s[centre][:, None]
        scale = np.abs(x).max(axis=1)
        x = x / scale[:, None]
        basis = x[:, :, None] ** np.arange(4)
        transposed = np.swapaxes(basis, 1, 2)  # |x| <= 1 keeps the normal equations well conditioned
        coefficients = np.linalg.solve(transposed @ basis, transposed @ values[index])
        results[0][centre] = coefficients[:, 0]
        results[1][centre] = coefficients[:, 1] / scale[:, None]
        results[2][centre] = 2.0 * coefficients[:, 2] / scale[:, None] ** 2
    return results


def choose_smoothing(time_s: Array, position_rad: Array) -> float:
    """The shortest smoothing that keeps the acceleration's noise small.

    Longer smoothing rounds off the corners of the acceleration (a jerk phase lasts some 25 ms), shorter lets the
    encoders' noise through. Noise is read off what a cubic through seven samples leaves over; its share in the second
    derivative over 2 h + 1 samples falls as h^-2.5.

    Args:
        time_s: Instants, shape (T,). [s]
        position_rad: Positions, shape (T, n). [rad]

    Returns:
        Smoothing length. [s]
    """
    step = float(np.median(np.diff(time_s)))
    fitted, _, curvature = local_cubic(time_s, position_rad, 6.0 * step)
    sevens = 2.0 / 3.0  # share of the noise's variance that a cubic through seven samples leaves at their middle
    noise = np.std(position_rad - fitted, axis=0) / np.sqrt(sevens)
    half = 2
    while (2 * half + 2) * step <= LONGEST_SMOOTHING_S:
        samples = 2 * half + 1
        spread = np.sqrt(720.0 / (samples * (samples**2 - 1) * (samples**2 - 4))) * noise / step**2
        acceleration = np.sqrt(np.mean(curvature**2, axis=0))
        if np.all(spread <= ACCELERATION_NOISE * acceleration.max()):
            break
        half += 1
    return round(2.0 * half * step, 9)


def prepare(log: MeasuredLog, robot: Robot, smoothing_s: float | None = None, window_s: float = WINDOW_S) -> Signals:
    """Differentiate, find motions, compute rigid-body torques.

    Args:
        log: Checked log.
        robot: Robot with its payload (the log's own payload column takes precedence).
        smoothing_s: See `local_cubic`; chosen by `choose_smoothing` if not given. [s]
        window_s: Length over which power is averaged. [s]

    Raises:
        InputError: Smoothing or window out of range, too short a log, or velocities that contradict the positions.
    """
    for key, length in (("smoothing_s", smoothing_s), ("window_s", window_s)):
        if length is not None:
            as_number(length, key, least=SHORTEST_LENGTH_S, most=LONGEST_LENGTH_S, unit="s")
    if len(log.time_s) < 50:
        raise InputError(f"the log has only {counted(len(log.time_s), 'row')}", file=log.source, allowed="at least 50")
    measured_step_s = float(np.median(np.diff(log.time_s)))
    sparse = is_sparse(log)
    if sparse:
        log = interpolated(log)
    if smoothing_s is None:
        smoothing_s = choose_smoothing(log.time_s, log.position_rad)
        if sparse:  # noise within a cubic cannot be seen: over two samples it evens out
            smoothing_s = max(smoothing_s, min(2.0 * measured_step_s, LONGEST_SMOOTHING_S))
    position, velocity, acceleration = local_cubic(log.time_s, log.position_rad, smoothing_s)
    if log.velocity_rad_s is not None:
        _check_measured_velocity(log, velocity)
        velocity, acceleration, _ = local_cubic(log.time_s, log.velocity_rad_s, smoothing_s)
    speed = np.abs(velocity) / robot.velocity_rad_s
    stands = speed < REST_SPEED
    moving = ~np.all(stands, axis=1)
    velocity = np.where(stands, 0.0, velocity)
    acceleration = np.where(moving[:, None], acceleration, 0.0)
    rigid = _rigid_torques(log, robot, position, velocity, acceleration)
    heavier = [
        _rigid_torques(log, robot, position, velocity, acceleration, body) - rigid for body in range(robot.joint_count)
    ]
    load = rigid + robot.drives.reflected_inertia_kg_m2 * acceleration
    weight = np.gradient(log.time_s)
    weight[[0, -1]] /= 2.0
    start, window_block, blocks = _windows(log.time_s, speed.max(axis=1), window_s)
    if blocks < FEWEST_BLOCKS:
        raise InputError(
            f"the log holds only {counted(blocks, 'motion')}",
            file=log.source,
            allowed=f"at least {FEWEST_BLOCKS} motions",
        )
    return Signals(
        time_s=log.time_s,
        velocity_rad_s=velocity,
        direction=np.sign(velocity),
        moving=moving,
        load_nm=load,
        load_change_nm=np.stack(heavier),
        smoothing_s=smoothing_s,
        torque_nm=log.torque_nm,
        power_w=log.power_w,
        weight_s=weight,
        window_start=start,
        window_s=np.add.reduceat(weight, start),
        window_block=window_block,
        blocks=blocks,
        interpolated_step_s=measured_step_s if sparse else None,
    )


def _check_measured_velocity(log: MeasuredLog, derived: Array) -> None:
    measured = np.asarray(log.velocity_rad_s)
    for joint in range(measured.shape[1]):
        square = float(derived[:, joint] @ derived[:, joint])
        if square < 1e-4 * len(derived):
            continue  # this joint hardly moves: no judgement
        slope = float(derived[:, joint] @ measured[:, joint]) / square
        if not 0.8 < slope < 1.25:
            raise InputError(
                f"the velocity is {slope:.3g} times the derivative of the position",
                file=log.source,
                key=f"q{joint + 1}_velocity_rad_s",
                allowed="rad/s on the link side",
            )
        off = float(np.sqrt(np.mean((measured[:, joint] - derived[:, joint]) ** 2) / (square / len(derived))))
        if off > LARGEST_VELOCITY_MISFIT:
            raise InputError(
                f"the velocity is off the derivative of the position by {off:.0%} of its size: late or saturated",
                file=log.source,
                key=f"q{joint + 1}_velocity_rad_s",
                allowed=f"up to {LARGEST_VELOCITY_MISFIT:.0%}",
            )


def _rigid_torques(
    log: MeasuredLog, robot: Robot, q: Array, qd: Array, qdd: Array, heavier_body: int | None = None
) -> Array:
    """Rigid-body torques (T, n), payload by payload; one body may be heavier than the robot file says."""
    masses = np.unique(log.payload_kg) if log.payload_kg is not None else np.array([robot.payload.mass_kg])
    if len(masses) > _MOST_PAYLOADS:
        raise InputError(
            f"the log names {len(masses)} payloads",
            file=log.source,
            key="payload_kg",
            allowed=f"up to {_MOST_PAYLOADS}",
        )
    torque, payload = np.empty_like(q), robot.payload
    for mass in masses:
        rows = np.full(len(q), True) if log.payload_kg is None else log.payload_kg == mass
        carried = payload if log.payload_kg is None else Payload(float(mass), payload.com_m)
        loaded = Robot(robot.file, carried, robot.source)
        if heavier_body is not None:
            body = loaded.mechanism.bodies[heavier_body].heavier(INERTIA_UNCERTAINTY)
            loaded = loaded.variant(mechanism=loaded.mechanism.with_body(heavier_body + 1, body))
        torque[rows] = inverse_dynamics(loaded, q[rows], qd[rows], qdd[rows])
    return torque


def _windows(time_s: Array, speed: Array, window_s: float) -> tuple[Index, Index, int]:
    """First instants of the windows, their blocks, and the number of blocks."""
    starts = [0, *_motion_boundaries(speed), len(time_s)]
    edges = [0]
    for first, last in pairwise(starts):
        parts = int(np.ceil((time_s[last - 1] - time_s[first]) / LONGEST_BLOCK_S)) or 1
        targets = np.linspace(time_s[first], time_s[last - 1], parts + 1)[1:-1]
        edges += [*np.searchsorted(time_s, targets).tolist(), last]
    window_start: list[int] = []
    window_block: list[int] = []
    for block, (first, last) in enumerate(pairwise(edges)):
        count = max(1, round((time_s[last - 1] - time_s[first]) / window_s))
        targets = np.linspace(time_s[first], time_s[last - 1], count + 1)[:-1]
        begin = np.unique(np.append(first, first + np.searchsorted(time_s[first:last], targets)))
        window_start += begin.tolist()
        window_block += [block] * len(begin)
    return np.array(window_start), np.array(window_block), len(edges) - 1


def _motion_boundaries(speed: Array) -> list[int]:
    """Instants midway between one motion and the next."""
    fast = np.concatenate([[False], speed > STOP_SPEED, [False]])
    change = np.flatnonzero(fast[1:] != fast[:-1])
    begins, ends = change[::2], change[1::2]
    return [int(middle) for middle in (ends[:-1] + begins[1:]) // 2]
