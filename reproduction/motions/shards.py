"""Large sets of random motions, simulated shard by shard: any worker may make any shard, in any order, at any time.

A shard depends on the set's description and its own number alone: its motions are drawn from a random stream of its
own, and it is simulated in blocks of fixed size, so that memory does not grow with the set or the shard. Its files
appear whole or not at all, the runs last. A set that was interrupted is therefore complete when the missing shards
are made, and its bytes do not depend on who made them.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from pydantic import Field, model_validator
from threadpoolctl import threadpool_limits

from reproduction.config import Percent, RobotParams
from reproduction.motions.tables import ends_columns, runs_table
from reproduction.tables import write_parquet
from reproduction.trees.generate import draw_point
from robojoule import __version__
from robojoule.arrays import Array
from robojoule.documents import Document, read_document, write_document
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import load_robot_file
from robojoule.robots.robot import Robot

MANIFEST = "manifest.json"
_BLOCK_MOTIONS = 250  # simulated at once


class MotionSet(Document):
    """Which random motions are simulated how."""

    robot: RobotParams
    seed: int = Field(ge=0)
    motions: int = Field(ge=1, description="Number of motions.")
    shard_motions: int = Field(default=10000, ge=1, description="Motions per shard.")
    budget_rad: tuple[float, float] = Field(
        default=(2.1, 4.5), description="Smallest and largest sum of a motion's joint changes. [rad]"
    )
    speed_limits_percent: list[Percent] = Field(
        default=[10, 20, 30, 40, 50, 60, 70, 80, 90, 100], min_length=1, description="Speed limits of every motion."
    )

    @model_validator(mode="after")
    def _ordered(self) -> MotionSet:
        if not 0 < self.budget_rad[0] <= self.budget_rad[1]:
            raise ValueError("budget_rad must be two positive numbers in rising order")
        if any(b <= a for a, b in pairwise(self.speed_limits_percent)):
            raise ValueError("speed_limits_percent must rise strictly")
        return self

    @property
    def shards(self) -> int:
        """Number of shards."""
        return -(-self.motions // self.shard_motions)

    def motion_ids(self, shard: int) -> range:
        """Identifiers of a shard's motions."""
        return range(shard * self.shard_motions, min((shard + 1) * self.shard_motions, self.motions))

    def key(self) -> dict[str, Any]:
        """All that the set's bytes depend on: this description, the robot's figures and the version of robojoule."""
        figures = load_robot_file(self.robot.name).model_dump_json()
        return {
            "robojoule": __version__,
            "robot_sha256": hashlib.sha256(figures.encode()).hexdigest(),
            **json.loads(self.model_dump_json()),
        }


@dataclass(frozen=True)
class ShardFolder:
    """Files of a motion set below a folder."""

    root: Path

    def motions(self, shard: int) -> Path:
        """Ends of a shard's motions."""
        return self.root / "motions" / f"part-{shard:05d}.parquet"

    def runs(self, shard: int) -> Path:
        """Runs of a shard's motions; written last."""
        return self.root / "runs" / f"part-{shard:05d}.parquet"

    @property
    def manifest(self) -> Path:
        """What the set was made from and which shards it has."""
        return self.root / MANIFEST


def open_folder(motion_set: MotionSet, root: Path) -> list[int]:
    """Claim a folder for a set, or go on with the one begun there.

    Args:
        motion_set: The set.
        root: Its folder; made if there is none.

    Returns:
        Numbers of the shards that are missing.

    Raises:
        InputError: The folder holds another set, or other files.
    """
    folder, key = ShardFolder(root), motion_set.key()
    if folder.manifest.exists():
        found = read_document(folder.manifest)
        known = found.get("made_from", {}) if isinstance(found, dict) else {}
        for name, value in key.items():
            if known.get(name) != value:
                raise InputError(
                    f"the folder holds a set with {name} {known.get(name)}, not {value}",
                    file=folder.manifest,
                    key=name,
                    allowed="the same parameters, or another folder",
                )
    elif root.exists() and (not root.is_dir() or any(root.iterdir())):
        raise InputError("this is not the folder of a motion set", file=root, allowed="an empty or a new folder")
    else:
        write_document(folder.manifest, {"made_from": key, "shards": []})
    for parts in (folder.motions(0).parent, folder.runs(0).parent):
        for stale in parts.glob(".*.parquet"):  # of a run that was killed, named by `atomic_path`
            stale.unlink()
    return [shard for shard in range(motion_set.shards) if not _is_complete(motion_set, folder, shard)]


def _is_complete(motion_set: MotionSet, folder: ShardFolder, shard: int) -> bool:
    motions = len(motion_set.motion_ids(shard))
    expected = {folder.motions(shard): motions, folder.runs(shard): motions * len(motion_set.speed_limits_percent)}
    try:
        return all(pq.read_metadata(path).num_rows == rows for path, rows in expected.items())
    except (OSError, pa.ArrowException):
        return False


def write_shard(motion_set: MotionSet, root: Path, shard: int) -> None:
    """Draw, simulate and write one shard.

    Args:
        motion_set: The set.
        root: Its folder.
        shard: Number of the shard, from 0.
    """
    folder, robot = ShardFolder(root), motion_set.robot.robot()
    rng = np.random.default_rng(np.random.SeedSequence(motion_set.seed, spawn_key=(shard,)))
    speed_limits = np.asarray(motion_set.speed_limits_percent) / 100.0
    identifiers = motion_set.motion_ids(shard)
    motions, runs = [], []
    with threadpool_limits(1):  # parallel by shards: threads inside would only compete
        for first in range(identifiers.start, identifiers.stop, _BLOCK_MOTIONS):
            block = np.arange(first, min(first + _BLOCK_MOTIONS, identifiers.stop))
            start, end = random_motions(robot, rng, len(block), motion_set.budget_rad)
            paths = MotionPaths(robot, start, end)
            motions.append(pa.table({"motion_id": pa.array(block, pa.int32()), **ends_columns(paths, end)}))
            runs.append(runs_table(block, paths.simulate(speed_limits)))
    write_parquet(folder.motions(shard), pa.concat_tables(motions))
    write_parquet(folder.runs(shard), pa.concat_tables(runs))


def random_motions(
    robot: Robot, rng: np.random.Generator, count: int, budget_rad: tuple[float, float]
) -> tuple[Array, Array]:
    """Draw motions from anywhere within the joint limits, each by a change as in Algorithm 1 of the thesis.

    Args:
        robot: Robot; its collisions are not regarded.
        rng: Random generator.
        count: Number of motions M.
        budget_rad: Smallest and largest sum of the joint changes; clamping to the limits may shorten it. [rad]

    Returns:
        Starts and ends, each of shape (M, n). [rad]
    """
    start = rng.uniform(robot.lower_rad, robot.upper_rad, (count, robot.joint_count))
    budgets = rng.uniform(*budget_rad, count)
    end = [
        draw_point(rng, q, float(budget), robot.lower_rad, robot.upper_rad)
        for q, budget in zip(start, budgets, strict=True)
    ]
    return start, np.array(end)


def close_folder(motion_set: MotionSet, root: Path) -> dict[str, Any]:
    """Write the manifest of a complete set.

    Args:
        motion_set: The set.
        root: Its folder.

    Returns:
        The manifest: what the set was made from; file, rows and SHA-256 of every table.

    Raises:
        InputError: A shard is missing.
    """
    folder = ShardFolder(root)
    shards = []
    for shard in range(motion_set.shards):
        if not _is_complete(motion_set, folder, shard):
            raise InputError(f"shard {shard} is missing", file=root)
        for path in (folder.motions(shard), folder.runs(shard)):
            shards.append(
                {
                    "file": path.relative_to(root).as_posix(),
                    "rows": pq.read_metadata(path).num_rows,
                    "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
                }
            )
    manifest = {"made_from": motion_set.key(), "shards": shards}
    write_document(folder.manifest, manifest)
    return manifest
