"""A small data set of motions whose features are known in closed form.

Every run is a seven-segment law of the path coordinate with its own acceleration and deceleration phase: jerk time
`t_j`, time of constant acceleration `t_a`, cruise time `t_v`. All switching times are multiples of the sampling step,
so that the samples hit the plateaus exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

STEP_S = 0.004
LIMITS = (10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0)
FIGURES = ("speed", "acceleration", "deceleration", "jerk_acceleration", "jerk_deceleration")


@dataclass(frozen=True)
class PathLaw:
    """Speed-up and slow-down of a run over a path of length 1."""

    speed_up_jerk_s: float
    speed_up_flat_s: float
    cruise_s: float
    slow_down_jerk_s: float
    slow_down_flat_s: float

    @property
    def speed_up_s(self) -> float:
        return 2 * self.speed_up_jerk_s + self.speed_up_flat_s

    @property
    def slow_down_s(self) -> float:
        return 2 * self.slow_down_jerk_s + self.slow_down_flat_s

    @property
    def duration_s(self) -> float:
        return self.speed_up_s + self.cruise_s + self.slow_down_s

    @property
    def velocity(self) -> float:
        return 1 / (self.speed_up_s / 2 + self.cruise_s + self.slow_down_s / 2)

    @property
    def acceleration(self) -> float:
        return self.velocity / (self.speed_up_jerk_s + self.speed_up_flat_s)

    @property
    def deceleration(self) -> float:
        return self.velocity / (self.slow_down_jerk_s + self.slow_down_flat_s)

    def figures(self) -> np.ndarray:
        """Path velocity, acceleration, deceleration, jerk while speeding up, |jerk| while slowing down."""
        return np.array(
            [
                self.velocity,
                self.acceleration,
                self.deceleration,
                self.acceleration / self.speed_up_jerk_s,
                self.deceleration / self.slow_down_jerk_s,
            ]
        )

    def samples(self) -> tuple[np.ndarray, ...]:
        """Time, position, velocity, acceleration, jerk at the sampling instants."""
        times = np.arange(round(self.duration_s / STEP_S) + 1) * STEP_S
        switches = np.cumsum(
            [
                0,
                self.speed_up_jerk_s,
                self.speed_up_flat_s,
                self.speed_up_jerk_s,
                self.cruise_s,
                self.slow_down_jerk_s,
                self.slow_down_flat_s,
                self.slow_down_jerk_s,
            ]
        )
        up, down = self.acceleration / self.speed_up_jerk_s, self.deceleration / self.slow_down_jerk_s
        jerks = np.array([up, 0, -up, 0, -down, 0, down])
        acceleration = np.interp(
            times, switches, [0, self.acceleration, self.acceleration, 0, 0, -self.deceleration, -self.deceleration, 0]
        )
        acceleration[np.abs(acceleration) < 1e-9] = 0.0
        jerk = jerks[np.minimum(np.searchsorted(switches[1:-1], times + 1e-9, side="right"), 6)]
        velocity = np.concatenate([[0], np.cumsum((acceleration[1:] + acceleration[:-1]) / 2 * STEP_S)])
        position = np.concatenate([[0], np.cumsum((velocity[1:] + velocity[:-1]) / 2 * STEP_S)])
        return times, position, velocity, acceleration, jerk


@dataclass(frozen=True)
class DataSet:
    """The tables of a synthetic data set and the laws of its fastest and slowest runs."""

    motions: pa.Table
    runs: pa.Table
    samples: pa.Table
    fastest: list[PathLaw]
    slowest: list[PathLaw]

    def write(self, data_dir: Path, shards: int = 2) -> None:
        """Write the tables as the pipeline lays them out."""
        samples_dir = data_dir / "samples"
        samples_dir.mkdir(parents=True)
        pq.write_table(self.motions, data_dir / "motions.parquet")
        pq.write_table(self.runs, data_dir / "runs.parquet")
        motion = self.samples["motion_id"].to_numpy()
        for shard, ids in enumerate(np.array_split(np.unique(motion), shards)):
            part = self.samples.filter(pa.array(np.isin(motion, ids)))
            pq.write_table(part, samples_dir / f"part-{shard:03d}.parquet")


def make(trees: int = 4, motions_per_tree: int = 4, joints: int = 6, seed: int = 1, experiment: int = 1) -> DataSet:
    """Draw a data set; each tree goes through its points and back, so that motions pair up."""
    random = np.random.default_rng(seed)
    count = trees * motions_per_tree
    half = motions_per_tree // 2
    points = random.uniform(-1.5, 1.5, (trees, half + 1, joints))
    there = np.concatenate([points, points[:, -2::-1]], axis=1)
    start, end = (there[:, :-1].reshape(count, joints), there[:, 1:].reshape(count, joints))
    places = np.concatenate([start[:, :3], end[:, :3]], axis=1) * 0.5
    turns = [_quaternions(configuration) for configuration in (start, end)]
    tree = np.repeat(np.arange(trees), motions_per_tree)
    split = np.where(tree >= trees - experiment, "experiment", np.where(tree % 3 == 1, "test", "train"))
    columns: dict[str, object] = {
        "motion_id": np.arange(count, dtype=np.int32),
        "tree_id": [f"{name}-{number:03d}" for name, number in zip(split, tree, strict=True)],
        "split": split,
        "order": np.tile(np.arange(1, motions_per_tree + 1, dtype=np.int32), trees),
        "robot": ["synthetic"] * count,
        "payload_kg": np.zeros(count),
    }
    for name, configuration in (("start", start), ("end", end)):
        columns |= {f"{name}_q{j + 1}_rad": configuration[:, j] for j in range(joints)}
    for name, offset, turn in (("start", 0, turns[0]), ("end", 3, turns[1])):
        columns |= {f"{name}_{axis}_m": places[:, offset + i] for i, axis in enumerate("xyz")}
        columns |= {f"{name}_q{part}": turn[:, i] for i, part in enumerate("wxyz")}

    runs: dict[str, list[object]] = {k: [] for k in ("motion_id", "speed_limit_percent", "duration_s", "energy_j")}
    runs["distinct"] = []
    parts: list[dict[str, np.ndarray]] = []
    fastest, slowest = [], []
    for motion in range(count):
        travel = np.abs(end[motion] - start[motion])
        weights = np.linspace(2.0, 0.5, joints)
        saved, held = 2 * float(weights @ travel), 60 + 20 * float(travel.max())
        for limit in LIMITS:
            cruise = round(4000 / limit)
            law = PathLaw(*(STEP_S * np.array([10, 5 + motion % 7, cruise, 12, 8 + motion % 5])))
            d = law.duration_s
            fast = LIMITS[-1]
            if limit == fast:
                fastest.append(law)
            if limit == LIMITS[0]:
                slowest.append(law)
            runs["motion_id"].append(motion)
            runs["speed_limit_percent"].append(limit)
            runs["duration_s"].append(d)
            runs["energy_j"].append(saved / d**2 + held * d + 100)
            runs["distinct"].append(True)
            time, position, velocity, acceleration, jerk = law.samples()
            parts.append(
                {
                    "motion_id": np.full(len(time), motion, dtype=np.int32),
                    "speed_limit_percent": np.full(len(time), limit, dtype=np.float32),
                    "time_s": time,
                    "path_position": position,
                    "path_velocity_per_s": velocity.astype(np.float32),
                    "path_acceleration_per_s2": acceleration.astype(np.float32),
                    "path_jerk_per_s3": jerk.astype(np.float32),
                    "power_w": np.full(len(time), 430, dtype=np.float32),
                }
            )
    samples = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    run_types = {"motion_id": pa.int32(), "distinct": pa.bool_()}
    return DataSet(
        motions=pa.table(columns),
        runs=pa.table({k: pa.array(v, run_types.get(k, pa.float64())) for k, v in runs.items()}),
        samples=pa.table(samples),
        fastest=fastest,
        slowest=slowest,
    )


def _quaternions(configuration: np.ndarray) -> np.ndarray:
    """Rotation about a fixed tilted axis by the sum of the first two joints, as (w, x, y, z)."""
    half = configuration[:, :2].sum(axis=1) / 2
    axis = np.array([0.6, 0.0, 0.8])
    return np.concatenate([np.cos(half)[:, None], np.sin(half)[:, None] * axis], axis=1)
