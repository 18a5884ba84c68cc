"""Give cycle.yaml a tenth more time, see what that saves, and write the slower program."""

import robojoule as rj

robot = rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)
program = rj.load_program("cycle.yaml")

# The program as it is: full speed, as no speed limit is given.
given = rj.simulate(program, robot)
print(f"as given: {given.cycle_time_s:.2f} s, {given.energy_j:.0f} J")

# The plan with the least energy. The saving is over the program as given that waits for the rest of the cycle.
plan = rj.optimize(program, robot, cycle_time="+10%")
print(f"planned:  {plan.cycle_time_s:.2f} s, {plan.energy_j:.0f} J, {plan.saving_percent:.1f} % saved")
for move in plan.moves:
    print(f"  {move.name}: {move.speed_limit_percent:.0f} % speed, waits {move.wait_after_s:.2f} s")
for warning in plan.warnings:
    print("warning:", warning)

plan.save("slower.yaml")
