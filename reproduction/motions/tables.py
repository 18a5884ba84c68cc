"""Simulated motions as Arrow tables: motions, runs, path torques and time series, with the contract's columns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from robojoule.arrays import Array, Index
from robojoule.documents import atomic_path
from robojoule.motion.simulation import MotionPaths, MotionRuns
from robojoule.motion.time_laws import PHASES
from robojoule.robots.drives import mains_power_w

RUN_COLUMNS = (
    "duration_s",
    "energy_j",
    "potential_j",
    "friction_j",
    "copper_j",
    "braking_j",
    "inverter_j",
    "base_j",
    "drive_active_j",
    "peak_power_w",
    "peak_torque_ratio",
)
SAMPLE_STATES = ("path_position", "path_velocity_per_s", "path_acceleration_per_s2", "path_jerk_per_s3")
SAMPLES_SCHEMA = pa.schema(
    [
        ("motion_id", pa.int32()),
        ("speed_limit_percent", pa.float32()),
        ("time_s", pa.float32()),
        *((name, pa.float32()) for name in SAMPLE_STATES),
        ("power_w", pa.float32()),
    ]
)


@dataclass(frozen=True)
class MotionTable:
    """Which motions a data set holds; M motions of n joints.

    Attributes:
        motion_id: Identifier of each motion, shape (M,).
        tree_id: Operation tree of each motion, M strings.
        split: train, test or experiment, M strings.
        order: Place of the motion in its tree, from 1, shape (M,).
        start_rad: Start configurations, shape (M, n). [rad]
        end_rad: End configurations, shape (M, n). [rad]
    """

    motion_id: Index
    tree_id: list[str]
    split: list[str]
    order: Index
    start_rad: Array
    end_rad: Array

    def rows(self, selected: slice) -> MotionTable:
        """The motions of a slice."""
        return MotionTable(
            self.motion_id[selected],
            self.tree_id[selected],
            self.split[selected],
            self.order[selected],
            self.start_rad[selected],
            self.end_rad[selected],
        )


def motions_of_trees(trees: pa.Table) -> MotionTable:
    """Motions between the consecutive points of every tree.

    Args:
        trees: Table with tree_id, split, point and q1_rad .. qn_rad, one row per point.
    """
    rows = trees.sort_by([("tree_id", "ascending"), ("point", "ascending")])
    joints = sum(name.startswith("q") and name.endswith("_rad") for name in rows.column_names)
    q = np.column_stack([rows[f"q{j + 1}_rad"].to_numpy() for j in range(joints)])
    tree = rows["tree_id"].to_pylist()
    first = np.flatnonzero([a == b for a, b in pairwise(tree)])
    split, point = rows["split"].to_pylist(), rows["point"].to_numpy()
    return MotionTable(
        motion_id=np.arange(len(first)),
        tree_id=[tree[i] for i in first],
        split=[split[i] for i in first],
        order=np.asarray(point[first] + 1, dtype=np.intp),
        start_rad=q[first],
        end_rad=q[first + 1],
    )


def motions_table(motions: MotionTable, paths: MotionPaths) -> pa.Table:
    """Table of the motions: ends in joint and tool space, and idle power there."""
    columns: dict[str, object] = {
        "motion_id": pa.array(motions.motion_id, pa.int32()),
        "tree_id": motions.tree_id,
        "split": motions.split,
        "order": pa.array(motions.order, pa.int32()),
        "robot": [paths.robot.name] * paths.motions,
        "payload_kg": np.full(paths.motions, paths.robot.payload.mass_kg),
    }
    return pa.table(columns | ends_columns(paths, motions.end_rad))


def ends_columns(paths: MotionPaths, end_rad: Array) -> dict[str, Array]:
    """Columns of the motions' ends, of shape (M, n) [rad]: in joint and tool space, and idle power there."""
    robot = paths.robot
    columns: dict[str, Array] = {}
    ends = {"start": paths.start_rad, "end": end_rad}
    for end, q in ends.items():
        columns |= {f"{end}_q{j + 1}_rad": q[:, j].copy() for j in range(robot.joint_count)}
    for end, q in ends.items():
        position, quaternion = robot.tool_placements(q)
        columns |= {f"{end}_{axis}_m": position[:, i].copy() for i, axis in enumerate("xyz")}
        columns |= {f"{end}_q{axis}": quaternion[:, i].copy() for i, axis in enumerate("wxyz")}
    columns["idle_power_start_w"] = paths.idle_power_start_w
    columns["idle_power_end_w"] = paths.idle_power_end_w
    return columns


def runs_table(motion_id: Index, runs: MotionRuns) -> pa.Table:
    """Table of the runs, ordered by motion and rising speed limit.

    `distinct` is false where a speed limit gives the same run as the next lower one: the two are one point of the
    energy profile.
    """
    motions, speeds = runs.duration_s.shape
    distinct = np.ones((motions, speeds), dtype=bool)
    distinct[:, 1:] = np.abs(np.diff(runs.duration_s, axis=1)) > 1e-9
    columns: dict[str, object] = {
        "motion_id": pa.array(np.repeat(motion_id, speeds), pa.int32()),
        "speed_limit_percent": np.round(runs.speed_limit.ravel() * 100.0, 9),
    }
    columns |= {name: getattr(runs, name).ravel() for name in RUN_COLUMNS}
    columns["distinct"] = distinct.ravel()
    return pa.table(columns)


def paths_table(motion_id: Index, paths: MotionPaths) -> pa.Table:
    """Table of the path torques: per joint the Chebyshev coefficients of m, c, g and the friction along the path.

    Joint j's torque at path state (s, s', s'', as stored in the samples) is
    m_j(s) s'' + c_j(s) s'^2 + g_j(s) + coulomb_j + viscous_j s'; m includes the rotor inertia.
    """
    drives = paths.robot.drives
    inertia = paths.torques.inertia_nm_s2.copy()
    inertia[:, 0, :] += drives.reflected_inertia_kg_m2 * paths.delta_rad
    columns: dict[str, object] = {"motion_id": pa.array(motion_id, pa.int32())}
    for name, coefficients in (
        ("inertia_nm_s2", inertia),
        ("velocity_nm_s2", paths.torques.velocity_nm_s2),
        ("gravity_nm", paths.torques.gravity_nm),
    ):
        own = [values[:count] for values, count in zip(coefficients, paths.torques.counts, strict=True)]
        columns |= {f"j{j + 1}_{name}": [values[:, j] for values in own] for j in range(paths.robot.joint_count)}
    for j in range(paths.robot.joint_count):
        columns[f"j{j + 1}_coulomb_nm"] = drives.coulomb_nm[j] * np.sign(paths.delta_rad[:, j])
        columns[f"j{j + 1}_viscous_nm_s"] = drives.viscous_nm_s_per_rad[j] * paths.delta_rad[:, j]
    return pa.table(columns)


def write_samples(path: Path, motion_id: Index, paths: MotionPaths, speed_limits: Array, rate_hz: float) -> None:
    """Write the time series of every run to one Parquet file, streamed motion by motion.

    Args:
        path: File to write.
        motion_id: Identifiers, shape (M,).
        paths: The motions.
        speed_limits: Fractions, shape (S,). [-]
        rate_hz: Sample rate; the final instant of each run is added. [Hz]
    """
    with atomic_path(path) as temporary, samples_writer(temporary) as writer:
        for batch in _sample_batches(motion_id, paths, speed_limits, rate_hz):
            writer.write_batch(batch, row_group_size=1 << 20)


def samples_writer(path: Path) -> pq.ParquetWriter:
    """Parquet file for time series: floats split into bytes, which compress better and faster."""
    floats = [name for name in SAMPLES_SCHEMA.names if name not in ("motion_id", "speed_limit_percent")]
    return pq.ParquetWriter(
        path,
        SAMPLES_SCHEMA,
        compression="zstd",
        compression_level=1,
        use_dictionary=["motion_id", "speed_limit_percent"],
        column_encoding=dict.fromkeys(floats, "BYTE_STREAM_SPLIT"),
        write_statistics=["motion_id", "speed_limit_percent"],
    )


_BATCH_MOTIONS = 50


def _sample_batches(
    motion_id: Index, paths: MotionPaths, speed_limits: Array, rate_hz: float
) -> Iterator[pa.RecordBatch]:
    percent = np.round(speed_limits * 100.0, 9)
    peaks = paths.peak_velocities(speed_limits)
    for first in range(0, paths.motions, _BATCH_MOTIONS):
        rows = np.arange(first, min(first + _BATCH_MOTIONS, paths.motions))
        moving = rows[paths.moving[rows]]
        laws = dict(zip(moving.tolist(), _laws(paths, peaks, moving), strict=True))
        parts: list[list[Array]] = []
        for motion in rows.tolist():
            time, run, states, power = _sample_motion(paths, motion, laws.get(motion), len(percent), rate_hz)
            parts.append([np.full(len(time), motion_id[motion]), percent[run], time, *states, power])
        arrays = [
            pa.array(np.concatenate(columns, dtype=field.type.to_pandas_dtype(), casting="same_kind"), field.type)
            for field, columns in zip(SAMPLES_SCHEMA, zip(*parts, strict=True), strict=True)
        ]
        yield pa.record_batch(arrays, schema=SAMPLES_SCHEMA)


def _laws(paths: MotionPaths, peaks: Array, rows: Index) -> Array:
    """Time laws of some motions, shape (M', 6, S, 7): start, jerk, acceleration, velocity, position, end of phases."""
    law = paths.laws(peaks[rows], rows)
    ends = np.cumsum(law.duration_s, axis=-1)
    starts = ends - law.duration_s
    starts[..., 1:] = ends[..., :-1]
    return np.stack([starts, law.jerk, law.acceleration, law.velocity, law.position, ends], axis=1)


def _sample_motion(
    paths: MotionPaths, motion: int, laws: Array | None, speeds: int, rate_hz: float
) -> tuple[Array, Index, tuple[Array, ...], Array]:
    """All runs of one motion: instants (T,), run of each instant (T,), four path states and mains power, each (T,)."""
    if laws is None:  # no length: the robot stands
        zero = np.zeros(speeds)
        return zero, np.arange(speeds), (zero,) * len(SAMPLE_STATES), np.full(speeds, paths.idle_power_start_w[motion])
    totals = laws[-1, :, -1]
    # A grid instant that falls on the end (up to rounding) is the final instant itself, not a second one.
    counts = np.floor(totals * rate_hz * (1.0 - 1e-12)).astype(np.intp) + 2
    last = np.cumsum(counts) - 1
    run = np.repeat(np.arange(speeds), counts)
    time = (np.arange(len(run)) - (last - counts + 1)[run]) / rate_hz
    time[last] = totals
    index = run * PHASES
    for starts in laws[0, :, 1:].T:
        index += time >= starts[run]
    start, jerk, acc, vel, pos = laws[:-1].reshape(len(laws) - 1, -1)[:, index]
    tau = time - start
    s = pos + tau * (vel + tau * (acc / 2 + tau * jerk / 6))
    s1 = vel + tau * (acc + tau * jerk / 2)
    s2 = acc + tau * jerk
    bus = paths.powers(np.array([motion]), s[None], s1[None], s2[None]).bus_w[0]
    return time, run, (s, s1, s2, jerk), mains_power_w(paths.robot.drives, bus)
