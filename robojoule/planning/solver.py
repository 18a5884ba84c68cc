"""Solve the planning model with HiGHS; one loaded model serves many cycle times.

Pyomo's persistent interface (`pyomo.contrib.solver`, "highs") keeps the model inside HiGHS: building a tree's model
takes about 10 ms, the first solution 50 ms, each further cycle time 2 ms (40 coefficients) to 5 ms (1800).
`appsi_highs` re-solves as fast but does not give the proven bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pyomo.environ as pyo
from pyomo.contrib.solver.common.factory import SolverFactory
from pyomo.contrib.solver.common.results import TerminationCondition

from robojoule.arrays import Array
from robojoule.errors import PlanningError
from robojoule.planning.costs import VertexCosts, check_costs, plan_energy_j
from robojoule.planning.graph import OptimizationGraph
from robojoule.planning.milp import build_model
from robojoule.planning.schedule import RELATIVE_GAP, Schedule, check_cycle_time

_CONVERGED = TerminationCondition.convergenceCriteriaSatisfied


class PlanSolver:
    """Solver of one graph with given costs, for any number of cycle times.

    Args:
        graph: Optimisation graph.
        costs: Costs of each vertex.
        preference_w: See `build_model`.
        relative_gap: Gap between plan and proven bound at which the search ends. [-]

    Raises:
        InputError: The costs do not fit the graph.
    """

    def __init__(
        self,
        graph: OptimizationGraph,
        costs: Sequence[VertexCosts],
        *,
        preference_w: float = 0.0,
        relative_gap: float = RELATIVE_GAP,
    ) -> None:
        check_costs(graph, costs)
        self.graph = graph
        self.costs = tuple(costs)
        self._preference_w = preference_w
        self._least_s = [cost.profile.d_min_s for cost in self.costs]
        self._model: pyo.ConcreteModel | None = None
        self._relative_gap = relative_gap
        self._solver = _new_solver(relative_gap)

    def solve(self, cycle_time_s: float) -> Schedule:
        """Plan for a cycle time.

        Args:
            cycle_time_s: Cycle time. [s]

        Raises:
            CycleTimeTooShort: The fastest cycle does not fit.
            PlanningError: No plan found.
        """
        check_cycle_time(self.graph, self._least_s, cycle_time_s)
        cycle_time_s = max(cycle_time_s, self.graph.least_cycle_s(self._least_s))
        if self._model is None:
            self._model = build_model(self.graph, self.costs, cycle_time_s, preference_w=self._preference_w)
        model = self._model
        model.w.set_value(cycle_time_s)
        case = f"{len(self.graph.vertices)} vertices, {len(self.graph.robots)} robots, cycle time {cycle_time_s:.6g} s"
        try:
            results = self._run(model)
            condition = results.termination_condition
            if results.incumbent_objective is not None:
                results.solution_loader.load_vars()
        except Exception as error:
            raise PlanningError(f"HiGHS failed on {case}: {error}") from error
        if results.incumbent_objective is None:
            raise PlanningError(f"HiGHS found no plan for {case} ({condition.name})")
        if condition != _CONVERGED:
            raise PlanningError(f"HiGHS did not finish {case} ({condition.name})")
        bound = float(results.objective_bound) if results.objective_bound is not None else float("nan")
        return self._plan(model, cycle_time_s, bound)

    def _run(self, model: pyo.ConcreteModel) -> Any:
        """Solve from the last basis; where rounding spoils that (optimal, yet not feasible), solve anew."""
        results = self._solver.solve(model)
        if results.incumbent_objective is None and results.termination_condition == _CONVERGED:
            self._solver = _new_solver(self._relative_gap)
            results = self._solver.solve(model)
        return results

    def _plan(self, model: pyo.ConcreteModel, cycle_time_s: float, bound_j: float) -> Schedule:
        def values(variable: Any) -> Array:
            return np.array([variable[v].value for v in model.V], dtype=float)

        profiles = [cost.profile for cost in self.costs]
        vertices = self.graph.vertices
        plan = Schedule(
            status="optimal",
            cycle_time_s=cycle_time_s,
            # Within the solver's tolerance a value may leave its bounds: put it back.
            durations_s=np.clip(values(model.dm), [p.d_min_s for p in profiles], [p.d_max_s for p in profiles]),
            prior_waits_s=np.maximum(values(model.dn), [v.least_prior_wait_s for v in vertices]),
            post_waits_s=np.maximum(values(model.dw), [v.least_post_wait_s for v in vertices]),
            collision_waits_s=np.maximum(values(model.dc), 0.0),
            starts_s=values(model.s),
            bound_j=bound_j,
        )
        # The preference is not an energy: taking its largest value from the bound keeps the bound valid.
        preference = self._preference_w * sum(profile.d_max_s for profile in profiles)
        return replace(plan, energy_j=plan_energy_j(self.costs, plan), bound_j=plan.bound_j - preference)


def model_plans(
    graph: OptimizationGraph,
    costs: Sequence[VertexCosts],
    cycle_times_s: Array,
    preference_w: float = 0.0,
    *,
    relative_gap: float = RELATIVE_GAP,
) -> list[Schedule]:
    """Plans of one graph for R cycle times [s] by one loaded model; see `PlanSolver`."""
    solver = PlanSolver(graph, costs, preference_w=preference_w, relative_gap=relative_gap)
    return [solver.solve(float(time)) for time in cycle_times_s]


def _new_solver(relative_gap: float) -> Any:
    solver: Any = SolverFactory("highs")
    config = solver.config
    config.threads = 1
    config.rel_gap = relative_gap
    config.abs_gap = 1e-9
    config.load_solutions = False
    config.raise_exception_on_nonoptimal_result = False
    # Integers are held tighter than by default: they multiply durations. Rounding of times is settled on writing back.
    config.solver_options = {"random_seed": 0, "mip_feasibility_tolerance": 1e-8}
    for update in config.auto_updates:  # between two solutions only the cycle time changes
        config.auto_updates[update] = update == "update_parameters"
    return solver
