"""A controller slower than its model: the plan is late in a trial, and is made again from what that took."""

import robojoule as rj

robot = rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)
program = rj.load_program("cycle.yaml")
plan = rj.optimize(program, robot, cycle_time=3.0)
print(f"planned: {plan.cycle_time_s:.2f} s, {plan.energy_j:.0f} J")

# On the machine the motions take 4 % longer than the model says; here that stands for a stopwatch.
moving_s = sum(move.duration_s for move in plan.moves)
measured_s = plan.cycle_time_s + 0.04 * moving_s
print(f"trial:   {measured_s:.2f} s")

again = rj.adjust(plan.program, robot, measured_cycle=measured_s, cycle_time=3.0)
print(f"again:   {again.cycle_time_s:.2f} s, {again.energy_j:.0f} J")
for warning in again.warnings:
    print("warning:", warning)
