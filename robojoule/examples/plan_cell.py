"""Plan the robots of cell.yaml together, and see what each of them does and takes."""

import robojoule as rj

(cell,) = rj.load_cells("cell.yaml")

# Orders, places, power modes, speeds and waits of all robots at once, with a proven bound.
plan = rj.optimize(cell, time_limit_s=60, gap_percent=0.01)
print(f"{plan.energy_j:.0f} J per cycle of {plan.cycle_time_s:g} s, at most {plan.gap_percent:.3f} % above the optimum")

for robot in cell.robots:
    steps = [step for step in plan.steps if step.robot == robot.name]
    print(f"{robot.name}: {sum(step.energy_j for step in steps):.0f} J")
    for step in steps:
        what = f"{step.activity} ({step.option}{', ' + step.mode if step.mode else ''})"
        print(f"  {step.start_s % cell.cycle_time_s:6.2f} s  {what:32} {step.duration_s:5.2f} s")
