"""What a plan must keep beside its cycle time: torques within their limits, and a largest power if one is asked for.

Every plan that is handed out goes through `Guard.told`, which refuses it or says what to know about it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from robojoule.formats.program import Program
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun, cycle_warnings, peak_warnings
from robojoule.planning.overload import bearing, check_overload, check_torques, of_the_limits
from robojoule.planning.path_checks import collision_warnings
from robojoule.planning.plan import Plan
from robojoule.planning.power_limit import check_power, check_power_limit, within_power
from robojoule.programs.operation_tree import OperationTree
from robojoule.programs.tree_check import in_model_angles, with_angles
from robojoule.robots.robot import Robot

Warnings = tuple[str, ...]


@dataclass(frozen=True)
class Guard:
    """Bounds of a plan.

    Attributes:
        peak_power_w: Largest mains power that the cycle may draw; any if None. [W]
        overload_percent: By how much torques may exceed the peak limits. [%]
    """

    peak_power_w: float | None
    overload_percent: float

    @classmethod
    def of(cls, peak_power_w: object, allow_overload_percent: object) -> Guard:
        """Bounds as people ask for them.

        Raises:
            InputError: They are not numbers, or out of range.
        """
        power_w = None if peak_power_w is None else check_power_limit(peak_power_w)
        return cls(power_w, check_overload(allow_overload_percent))

    def bearing(self, robot: Robot) -> Robot:
        """The robot as far as its torques may go."""
        return bearing(robot, self.overload_percent)

    def bounded(self, batch: TreeBatch) -> TreeBatch:
        """The one tree of a batch with speed limits within the power.

        Raises:
            InputError: A movement exceeds the power at its least speed.
        """
        if self.peak_power_w is None:
            return batch
        tree = within_power(batch, batch.trees[0], self.peak_power_w)
        return TreeBatch(batch.robot, [tree], batch.slowest_speed_limit)

    def told(self, plan: Plan, as_given: Program, robot: Robot, asked_s: float | None = None) -> Plan:
        """A plan in the angles that were given, checked, with everything to know about it.

        Args:
            plan: The plan, in angles of the robot's model.
            as_given: The program as it was given.
            robot: The robot as it is.
            asked_s: Cycle time that it was made for, so that it does not shrink by what rounding leaves of it, trial by
                trial; that of the plan if not given. [s]

        Raises:
            InputError: A torque exceeds its peak limit by more than is allowed, or standing exceeds the power.
            PlanningError: A movement exceeds the power.
        """
        tree, given = plan.program.tree, as_given.tree
        tree = tree.planned_for(plan.cycle_time_s if asked_s is None else asked_s)
        if as_given.remembers:
            tree = tree.bounded_by(given)
        if given.angles != tree.angles:
            tree = with_angles(tree, given.angles, given.configurations_rad())
        run, known = self._judged(plan.run, plan.program.tree, as_given, robot)
        peaks = peak_warnings(run) if self.overload_percent else ()  # else the plan has them
        warnings = (*known, *peaks, *plan.warnings)
        return replace(plan, run=run, program=replace(as_given, tree=tree), warnings=warnings)

    def judged(self, run: CycleRun, program: Program, as_given: Program, robot: Robot) -> tuple[CycleRun, Warnings]:
        """The simulation of a program of a cell with its torques checked, and everything to know about it.

        Args:
            run: The simulation.
            program: The program with its plan, in the angles that were given.
            as_given: The program as it was given.
            robot: The robot as it is.

        Raises:
            InputError: A torque exceeds its peak limit by more than is allowed.
        """
        tree = in_model_angles(program.tree, robot)
        judged, known = replace(self, peak_power_w=None)._judged(run, tree, as_given, robot)
        return judged, (*known, *cycle_warnings(tree, judged))

    def _judged(self, run: CycleRun, tree: OperationTree, given: Program, robot: Robot) -> tuple[CycleRun, Warnings]:
        """A run with torques as shares of the limits as they are, checked; what to know about robot and paths."""
        run = of_the_limits(run, self.overload_percent)
        check_torques(run, self.overload_percent)
        if self.peak_power_w is not None:
            check_power(run, self.peak_power_w)
        return run, (*given.warnings_for(robot), *collision_warnings(tree, robot))
