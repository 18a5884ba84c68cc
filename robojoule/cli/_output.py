"""What several commands print."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from robojoule.formats.program import Program
    from robojoule.robots.robot import Robot


def payloads_kg(program: Program, robot: Robot) -> list[float]:
    """What the robot carries in the moves of a program, each once, in the order of the moves. [kg]"""
    return program.for_robot(robot).tree.payloads_kg(float(robot.payload.mass_kg))


def show_head(result: dict[str, Any]) -> None:
    """Print which program on which robot, and what it carries: what the program sets counts, if it does."""
    *masses, last = [f"{mass:g}" for mass in result["payloads_kg"]]
    is_set = result["payloads_kg"] != [result["payload_kg"]]
    listed = f"{', '.join(masses)} and {last}" if masses else last
    said = f"payload {listed} kg{' as the program sets it' if is_set else ''}"
    print(f"{result['program']} on {result['robot']}, {said}")


def show_loads(result: dict[str, Any], where: str = "") -> None:
    """Print the largest power and torques."""
    print(
        f"{where}largest mains power {result['peak_power_w']:.1f} W, "
        f"largest torque {100.0 * result['peak_torque_ratio']:.1f} % of its peak limit, "
        f"{100.0 * result['rms_torque_ratio']:.1f} % of the continuous one (root mean square)"
    )


def show_moves(result: dict[str, Any]) -> None:
    """Print the moves as a table, and what to know."""
    names = [_named(move) for move in result["moves"]]
    width = max(len("move"), *map(len, names))
    print(f"{'move':{width}}  speed limit [%]  duration [s]  wait before [s]  wait after [s]  energy [J]")
    for name, move in zip(names, result["moves"], strict=True):
        print(
            f"{name:{width}}  {move['speed_limit_percent']:15.2f}  {move['duration_s']:12.4f}  "
            f"{move['wait_before_s']:15.4f}  {move['wait_after_s']:14.4f}  {move['energy_j']:10.1f}"
        )
    for note in result.get("program_notes", ()):
        print(f"note: {note}")
    for warning in result["warnings"]:
        print(f"warning: {warning}")


def _named(move: dict[str, Any]) -> str:
    """A move, with how many coarse ones before it belong to the same motion."""
    count = len(move["through"])
    return f"{move['name']} (and {count} before)" if count else str(move["name"])


def show_diff(result: dict[str, Any]) -> None:
    """Print what changes in the program's files, if that was asked for."""
    if "diff" in result:
        print(result["diff"] or "nothing changes in the program's files", end="" if result["diff"] else "\n")


def show_written(result: dict[str, Any], *names: str) -> None:
    """Print the files that were written, each under the name of its option."""
    from robojoule.formats.registry import companions_of

    for name in names:
        if result.get(name):
            print(f"written to {' and '.join([result[name], *map(str, companions_of(Path(result[name])))])}")


def show_outlook(result: dict[str, Any]) -> None:
    """Print reserve, and how sure the plan is, where that is known."""
    if result["reserve_s"]:
        print(f"reserve {result['reserve_s']:.4f} s, as a wait at the end")
    outlook = result["outlook"]
    if outlook is None:
        return
    if outlook["late_probability"] is not None:
        deviation, late = 1e3 * outlook["cycle_deviation_s"], 100.0 * outlook["late_probability"]
        print(
            f"controller: {outlook['rule']}; cycle time +- {deviation:.1f} ms, late (by more than 0.01 %) in "
            f"{late:.2g} % of such plans"
        )
    if outlook["saving_low_percent"] is not None:
        low, high = outlook["saving_low_percent"], outlook["saving_high_percent"]
        print(f"saving against the program as given: {low:.1f} to {high:.1f} % (90 % interval)")
