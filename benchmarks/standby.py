"""What standby modes are worth, with and without plans, as a Markdown table: `python -m benchmarks.standby`.

The KR210 of the catalog with the standby of the six KUKA arms of a Skoda Auto cell (medians; CTU-IIG
GeneratorOfRoboticCells), on a cycle of three handling motions at 60 % of the rated payload. The program as given runs
at full speed and waits at its end.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

import robojoule as rj
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.robots.robot import Payload, Robot
from robojoule.robots.standby import StandbyFile, StandbyModeFile

NAME = "kuka_kr210_r2700_2"
# Shares of the power with motors on, 681.5 W: brakes 259 W, bus off 177.5 W.
BRAKES, BUS_OFF = 0.38, 0.26
LEAST_IDLE_S = (2.0, 25.0)
CYCLES = (1.1, 1.5, 2.0, 4.0, 10.0)
STOPS_DEG = ([0, -90, 90, 0, 0, 0], [50, -70, 80, 0, 30, 0], [-20, -60, 100, 40, 0, 0], [0, -90, 90, 0, 0, 0])


def robots() -> tuple[Robot, Robot]:
    """The robot without and with standby modes."""
    plain = rj.load_robot(NAME)
    payload = Payload(0.6 * plain.file.rated_payload_kg)
    plain = Robot(plain.file, payload)
    program = rj.Program(tree_from_configurations("handling", np.radians(STOPS_DEG)))
    run = rj.simulate(rj.Program(program.tree.with_plan({}, waits_after_s={program.moves[-1].name: 1.0})), plain)
    idle_w = run.energy_j - rj.simulate(program, plain).energy_j  # of one second
    modes = [
        StandbyModeFile(power_w=share * idle_w, least_idle_s=least)
        for share, least in zip((BRAKES, BUS_OFF), LEAST_IDLE_S, strict=True)
    ]
    standby = StandbyFile(brakes=modes[0], bus_off=modes[1])
    return plain, Robot(plain.file.model_copy(update={"standby": standby}), payload)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    argparse.ArgumentParser(prog="python -m benchmarks.standby", description=main.__doc__).parse_args(arguments)
    plain, modes = robots()
    program = rj.Program(tree_from_configurations("handling", np.radians(STOPS_DEG)))
    fastest_s = rj.simulate(program, plain).cycle_time_s
    columns = ("cycle [% of the fastest]", "plan, motors on", "standby alone", "plan and standby", "plan over standby")
    print("| " + " | ".join(columns) + " |")
    print("|---|---|---|---|---|")
    for share in CYCLES:
        held, plan = (rj.optimize(program, robot, cycle_time=share * fastest_s) for robot in (plain, modes))
        alone = 100.0 * plan.standby_given_j / plan.energy_given_motors_on_j
        savings = (held.saving_percent, alone, plan.saving_over_motors_on_percent, plan.saving_percent)
        print(f"| {100.0 * share:.0f} | " + " | ".join(f"{saving:.1f} %" for saving in savings) + " |")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
