"""The plan of a cycle: the program with its plan written into it, and what the simulation of that says."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from robojoule.errors import PlanningError
from robojoule.formats.program import Program
from robojoule.planning.any_plan import gap_percent, percent
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun, MoveRun, cycle_warnings, simulate_trees
from robojoule.planning.schedule import Schedule
from robojoule.planning.speed_choice import Outlook
from robojoule.programs.operation_tree import OperationTree
from robojoule.robots.standby import standing_energy_j

LEAST_GAIN = 5e-6  # share of the energy by which a plan must be better than the program as given to replace it
LATE_S = 1e-6  # by how much a simulated cycle may differ from its cycle time: rounding


@dataclass(frozen=True, eq=False)
class Plan:
    """Speed limits and waits with the least energy for a cycle time, simulated as they stand in the program.

    All energies are those of one cycle. A program that takes less than the cycle time waits at its end for the rest of
    it, so energies of equal cycle times are compared. A given program that takes more than the cycle time counts with
    its own, longer cycle, and `warnings` says so.

    Attributes:
        program: The program with speed limits and waits of the plan.
        robot: Name of the robot.
        payload_kg: What the robot carries. [kg]
        run: Simulation of the program.
        least_cycle_time_s: Cycle time with all moves at their highest speed limits and required waits only. [s]
        energy_given_j: Energy of the program as given, its waits in standby where the controller has that. [J]
        energy_unoptimized_j: Energy with all moves but the fixed ones at full speed and a wait at the end until the
            cycle time. [J]
        bound_j: Proven lower bound of the energy of every plan for this cycle time in speed limits of this step, by the
            profiles that were planned on. [J]
        warnings: What to know before the plan is used, a sentence each.
        reserve_s: Slack that the plan keeps as a wait at its end. [s]
        profiles: Where its energy profiles come from: simulated, predicted or measured.
        outlook: How sure it is; None where neither timing nor energies were learnt from the machine.
        standby_given_j: What standby modes save on the waits of the program as given. [J]
    """

    program: Program
    robot: str
    payload_kg: float
    run: CycleRun
    least_cycle_time_s: float
    energy_given_j: float
    energy_unoptimized_j: float
    bound_j: float
    warnings: tuple[str, ...] = ()
    reserve_s: float = 0.0
    profiles: str = "simulated"
    outlook: Outlook | None = None
    standby_given_j: float = 0.0

    def __repr__(self) -> str:
        return (
            f"Plan({self.program.name!r} on {self.robot!r}: cycle_time_s={self.cycle_time_s:.6g}, "
            f"energy_j={self.energy_j:.6g}, saving_percent={self.saving_percent:.4g}, moves={len(self.run.names)}, "
            f"warnings={len(self.warnings)})"
        )

    @property
    def cycle_time_s(self) -> float:
        """Cycle time of the plan. [s]"""
        return self.run.cycle_time_s

    @property
    def energy_j(self) -> float:
        """Energy of the plan. [J]"""
        return self.run.energy_j

    @property
    def saving_percent(self) -> float:
        """Energy that the plan saves against the program as given. [%]"""
        return percent(self.energy_given_j - self.energy_j, self.energy_given_j)

    @property
    def energy_given_motors_on_j(self) -> float:
        """Energy of the program as given with motors that hold in every wait. [J]"""
        return self.energy_given_j + self.standby_given_j

    @property
    def saving_over_motors_on_percent(self) -> float:
        """Energy that plan and standby save against the program as given with motors that hold in every wait. [%]"""
        return percent(self.energy_given_motors_on_j - self.energy_j, self.energy_given_motors_on_j)

    @property
    def saving_over_unoptimized_percent(self) -> float:
        """Energy that the plan saves against full speed and waiting at the end. [%]"""
        return percent(self.energy_unoptimized_j - self.energy_j, self.energy_unoptimized_j)

    @property
    def gap_to_optimum_percent(self) -> float:
        """By how much the plan's energy is above the proven bound at most. [%]"""
        return percent(self.energy_j - self.bound_j, self.bound_j)

    @property
    def gap_percent(self) -> float:
        """The same relative to the plan's energy, as plans of cells state it. [%]"""
        return gap_percent(self.energy_j, self.bound_j)

    @property
    def peak_torque_ratio(self) -> float:
        """Largest joint torque over its peak limit. [-]"""
        return self.run.peak_torque_ratio

    @property
    def rms_torque_ratio(self) -> float:
        """Largest root mean square of a joint torque over the cycle, over its continuous limit. [-]"""
        return self.run.rms_torque_ratio

    @property
    def peak_power_w(self) -> float:
        """Largest mains power of the planned cycle: of motions, of standing and of process steps. [W]"""
        return self.run.peak_power_w

    @property
    def moves(self) -> tuple[MoveRun, ...]:
        """The moves in order of execution."""
        return self.run.moves

    def save(self, path: str | Path) -> None:
        """Write the program with the plan in the format that the suffix names; see `Program.save`.

        Comments of a YAML file say what the plan takes, and what to know about it.
        """
        self.program.save(path, self.remarks())

    def remarks(self) -> tuple[str, ...]:
        """What the plan takes, and what to know about it, a line each."""
        return (
            f"plan for {self.robot} with {self.payload_kg:g} kg: cycle time {self.cycle_time_s:.3f} s, "
            f"energy {self.energy_j:.1f} J",
            f"largest mains power {self.peak_power_w:.0f} W, largest torque {100.0 * self.peak_torque_ratio:.1f} % of "
            f"its peak limit, {100.0 * self.rms_torque_ratio:.1f} % of the continuous one (root mean square)",
            *(f"warning: {warning}" for warning in self.warnings),
        )

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain data, ready for JSON."""
        return {
            "program": self.program.name,
            "robot": self.robot,
            "payload_kg": self.payload_kg,
            **self.run.to_dict(),
            **{
                name: getattr(self, name)
                for name in (
                    "least_cycle_time_s",
                    "energy_given_j",
                    "energy_given_motors_on_j",
                    "energy_unoptimized_j",
                    "saving_percent",
                    "saving_over_motors_on_percent",
                    "saving_over_unoptimized_percent",
                    "bound_j",
                    "gap_to_optimum_percent",
                )
            },
            "reserve_s": self.reserve_s,
            "profiles": self.profiles,
            "outlook": None if self.outlook is None else asdict(self.outlook),
            "warnings": list(self.warnings),
        }


def plan_of(
    program: Program,
    batch: TreeBatch,
    written: OperationTree,
    runs: tuple[CycleRun, CycleRun, CycleRun],
    idle_power_w: float,
    **rest: Any,
) -> Plan:
    """A plan beside what it is compared with.

    Args:
        program: The program.
        batch: Its motions.
        written: The tree with the plan.
        runs: Cycles of the plan, of the program as given, and at full speed.
        idle_power_w: Power of waiting at the end of a cycle. [W]
        rest: Other attributes of the plan.
    """
    run, given, fastest = runs
    return Plan(
        program=replace(program, tree=written),
        robot=batch.robot.name,
        payload_kg=float(batch.robot.payload.mass_kg),
        run=run,
        energy_given_j=waiting_until(given, run.cycle_time_s, idle_power_w),
        standby_given_j=standby_until(given, run.cycle_time_s, idle_power_w),
        energy_unoptimized_j=waiting_until(fastest, run.cycle_time_s, idle_power_w),
        **rest,
    )


def verify(batch: TreeBatch, written: OperationTree, schedule: Schedule, wait_step_s: float = 0.0) -> CycleRun:
    """Simulate a tree with a plan in it, and refuse it if it does not hold the plan's cycle time.

    Args:
        batch: The one tree that was planned.
        written: The tree with the plan.
        schedule: The plan.
        wait_step_s: Step of added waits, by which the cycle may be shorter. [s]

    Raises:
        PlanningError: The simulated cycle is longer or shorter by more than rounding and the step.
    """
    run = simulate_trees(batch, [[written]])[0][0]
    late = run.cycle_time_s - schedule.cycle_time_s
    if not -LATE_S - wait_step_s <= late <= LATE_S:
        raise PlanningError(f"the simulated cycle of '{written.name}' differs from the planned one by {late:.3g} s")
    return run


def is_as_good(given: CycleRun, planned: CycleRun) -> bool:
    """Whether a program as given keeps the planned cycle time with no more energy than the plan.

    What plans may miss does not count: a plan that is planned again stays as it is.
    """
    on_time = abs(given.cycle_time_s - planned.cycle_time_s) <= LATE_S
    return on_time and given.energy_j <= planned.energy_j * (1.0 + LEAST_GAIN)


def waiting_until(run: CycleRun, cycle_time_s: float, idle_power_w: float) -> float:
    """Energy of a cycle that waits at its end until the cycle time, if it is shorter, in standby where it can. [J]"""
    waited_s = max(cycle_time_s - run.cycle_time_s, 0.0)
    if not run.standby:
        return run.energy_j + waited_s * idle_power_w
    before, after = standing_energy_j(
        run.standby, idle_power_w, [run.end_standing_s, run.end_standing_s + waited_s]
    ).tolist()
    return run.energy_j + float(after - before)


def standby_until(run: CycleRun, cycle_time_s: float, idle_power_w: float) -> float:
    """What standby modes save on such a cycle against motors that hold in every wait. [J]"""
    held_j = run.energy_j + run.standby_saving_j + max(cycle_time_s - run.cycle_time_s, 0.0) * idle_power_w
    return held_j - waiting_until(run, cycle_time_s, idle_power_w) if run.standby else 0.0


def faster_warnings(ran: OperationTree, planned: OperationTree) -> tuple[str, ...]:
    """What to say where nobody knows the program's own speed limits and moves are faster than in the plan that ran."""
    pairs = zip(ran.moves(), planned.moves(), strict=True)
    faster = [new.name for was, new in pairs if new.speed_limit_percent > was.speed_limit_percent]
    if not faster:
        return ()
    names = ", ".join(f"'{name}'" for name in faster)
    return (f"{names} faster than in the plan that ran: what the program allows is known from the one before it alone",)


def plan_warnings(tree: OperationTree, run: CycleRun, given: CycleRun) -> tuple[str, ...]:
    """What to know about a plan, a sentence each.

    Args:
        tree: The tree with the plan.
        run: Its simulation.
        given: Simulation of the program as given.
    """
    if given.cycle_time_s <= run.cycle_time_s + LATE_S:
        return cycle_warnings(tree, run)
    longer = f"the program as given takes {given.cycle_time_s:.4f} s, longer than the plan"
    return (*cycle_warnings(tree, run), f"{longer}: its energy is that of its own cycle")
