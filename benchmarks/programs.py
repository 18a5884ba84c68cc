"""Random programs of every robot in every language, planned, written, read and planned again.

`python -m benchmarks.programs` prints a line for each robot and language and ends with 1 if a promise was broken.
What is promised of every program: the plan's energy is not above the given program's; no speed limit, joint limit or
peak torque of the given program is exceeded; the cycle time holds after rounding; a program that is not planned is
written byte for byte as it was; planned again for the same cycle time, the written program stays as it is.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import robojoule as rj
from robojoule.checks import model_program
from robojoule.errors import InputError
from robojoule.formats.program import load_program
from robojoule.formats.registry import format_of
from robojoule.formats.vendor.files import VendorFiles
from robojoule.programs.operation_tree import OperationTree
from robojoule.robots import list_robots, load_robot
from robojoule.robots.robot import Payload, Robot
from robojoule.robots.urdf import write_urdf

SUFFIXES = {"KUKA": ".src", "FANUC": ".ls", "Universal Robots": ".script"}
OWN = (".yaml", ".csv")  # every robot's, beside its vendor's language
URDF_OF = "kuka_kr16_r2010_2"  # whose figures the arm with RAPID has; the catalog has no ABB
LONGER = (1.0, 1.15)  # cycle times over the given program's
SAME_S = 2e-5  # of cycle times: the digits of \T
SAME_ENERGY = 1e-6
WITHIN = 1e-6


@dataclass
class Outcome:
    """What came of one program.

    Attributes:
        saving_percent: Of the plan against the program as given, at a given cycle time. [%]
        broken: Promises that were broken, a sentence each.
    """

    saving_percent: float = 0.0
    broken: list[str] = field(default_factory=list)


def arms(folder: Path) -> Iterator[tuple[Robot, tuple[str, ...]]]:
    """Robots with half of their rated payload, and the suffixes of their languages."""
    for name in list_robots():
        robot = load_robot(name)
        half = Payload(0.5 * robot.file.rated_payload_kg)
        yield Robot(robot.file, half, robot.source), (SUFFIXES[robot.vendor], *OWN)
    path = folder / "six_axes.urdf"
    write_urdf(load_robot(URDF_OF).file, path)
    robot = load_robot(path, payload_kg=0.5 * load_robot(URDF_OF).file.rated_payload_kg)
    yield robot, (".mod",)


def random_tree(robot: Robot, moves: int, seed: int, coarse: float = 0.0) -> OperationTree:
    """Moves between random configurations, with whole speed limits and some waits, in angles of the model.

    Args:
        robot: The robot.
        moves: How many.
        seed: Of the random numbers.
        coarse: Which share of the moves that nothing but a move follows has a zone. [-]
    """
    chance = np.random.default_rng(seed)
    middle, half = 0.5 * (robot.lower_rad + robot.upper_rad), 0.5 * (robot.upper_rad - robot.lower_rad)
    position = middle + 0.4 * half * chance.uniform(-1.0, 1.0, robot.joint_count)
    operations = []
    start = position
    for number in range(moves):
        change = chance.normal(0.0, 0.6, robot.joint_count)
        position = np.clip(position + change, middle - 0.9 * half, middle + 0.9 * half)
        more: dict[str, object] = {}
        if chance.random() < 0.4:
            more["wait_after_s"] = round(float(chance.uniform(0.1, 1.0)), 2)
        elif coarse and number < moves - 1 and chance.random() < coarse:
            more["zone"] = {"radius_m": float(chance.choice([0.01, 0.05, 0.1]))}
        speed = float(chance.integers(30, 101))
        target = tuple(np.round(np.degrees(position), 3).tolist())
        operations.append(
            {"type": "move", "name": f"p{number}", "target_deg": target, "speed_limit_percent": speed, **more}
        )
    return OperationTree.model_validate(
        {
            "format": "robojoule-operation-tree",
            "version": 1,
            "name": "random",
            "start_deg": np.round(np.degrees(start), 3).tolist(),
            "operations": operations,
        }
    )


def outcome(
    robot: Robot, suffix: str, folder: Path, *, moves: int, seed: int, longer: float, coarse: float = 0.0
) -> Outcome:
    """One random program through all of it, planned for so many times the given program's cycle time."""
    found = Outcome()
    given_path, planned_path, again_path = (folder / f"{name}{suffix}" for name in ("given", "planned", "again"))
    _write(random_tree(robot, moves, seed, coarse), given_path, robot)
    given = load_program(given_path).for_robot(robot)
    given.save(folder / f"same{suffix}")
    if (folder / f"same{suffix}").read_bytes() != given_path.read_bytes():
        found.broken.append("saved without a plan, the program differs")
    run = rj.simulate(given, robot)
    cycle_time_s = longer * run.cycle_time_s
    plan = rj.optimize(given, robot, cycle_time=cycle_time_s)
    found.saving_percent = plan.saving_percent
    if plan.energy_j > plan.energy_given_j * (1.0 + SAME_ENERGY):
        found.broken.append(f"the plan takes {plan.energy_j:.3f} J, the given program {plan.energy_given_j:.3f} J")
    plan.save(planned_path)
    written = load_program(planned_path).for_robot(robot)
    found.broken += _limits_exceeded(given, written, robot)
    run_written = rj.simulate(written, robot)
    if run_written.cycle_time_s > cycle_time_s + SAME_S * moves:
        found.broken.append(f"the written program takes {run_written.cycle_time_s:.6f} s of {cycle_time_s:.6f} s")
    if run_written.peak_torque_ratio > max(run.peak_torque_ratio, 1.0) + WITHIN:
        found.broken.append(f"the largest torque is {run_written.peak_torque_ratio:.4f} of its limit")
    rj.optimize(written, robot, cycle_time=cycle_time_s).save(again_path)
    if again_path.read_bytes() != planned_path.read_bytes():
        found.broken.append("planned again for the same cycle time, the program changes")
    return found


def _write(tree: OperationTree, path: Path, robot: Robot) -> None:
    language = format_of(path)
    if isinstance(language, VendorFiles):
        language.create(tree, path, robot)
    else:
        rj.Program(tree).save(path)


def _limits_exceeded(given: rj.Program, written: rj.Program, robot: Robot) -> Iterator[str]:
    """Speed limits above the given ones, and targets beyond joint limits."""
    for before, after in zip(given.moves, written.moves, strict=True):
        if after.speed_limit_percent > before.speed_limit_percent * (1.0 + WITHIN):
            yield f"{after.name} has {after.speed_limit_percent:g} % instead of {before.speed_limit_percent:g} %"
    places = model_program(written, robot).tree.configurations_rad()
    if (places < robot.lower_rad - WITHIN).any() or (places > robot.upper_rad + WITHIN).any():
        yield "a target is beyond a joint limit"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all programs, a line of JSON for each robot and language."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.programs", description=main.__doc__)
    parser.add_argument("--programs", type=int, default=10, help="programs of each robot in each language")
    parser.add_argument("--moves", type=int, default=6, help="moves of a program")
    parser.add_argument("--coarse", type=float, default=0.0, help="share of moves with zones")
    parser.add_argument("--robot", action="append", help="only this one; may be repeated")
    options = parser.parse_args(arguments)
    broken = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for robot, suffixes in arms(folder):
            if options.robot and robot.name not in options.robot:
                continue
            for suffix in suffixes:
                if options.coarse and suffix == ".csv":  # which has no zones
                    continue
                begun, savings, problems = time.perf_counter(), [], []
                for seed in range(options.programs):
                    longer = LONGER[seed % len(LONGER)]
                    try:
                        one = outcome(
                            robot,
                            suffix,
                            folder,
                            moves=options.moves,
                            seed=seed,
                            longer=longer,
                            coarse=options.coarse,
                        )
                    except InputError as error:
                        one = Outcome(broken=[str(error)])
                    savings.append(one.saving_percent)
                    problems += [f"{seed}: {text}" for text in one.broken]
                broken += len(problems)
                line = {
                    "robot": robot.name,
                    "language": suffix,
                    "programs": options.programs,
                    "median_saving_percent": round(float(np.median(savings)), 2),
                    "seconds": round(time.perf_counter() - begun, 1),
                    "broken": problems,
                }
                print(json.dumps(line), flush=True)
    return 1 if broken else 0


if __name__ == "__main__":
    raise SystemExit(main())
