"""What a heavier gripper costs: energy of the same plan for several payloads, centre of mass 0.15 m from the flange."""

import robojoule as rj

program = rj.load_program("cycle.yaml")

for mass_kg in (0, 4, 8, 12, 16):
    robot = rj.load_robot("kuka_kr16_r2010_2", payload=rj.Payload(mass_kg, (0.0, 0.0, 0.15)))
    plan = rj.optimize(program, robot, cycle_time=3.0)
    torque = 100 * plan.peak_torque_ratio
    print(f"{mass_kg:2} kg: {plan.energy_j:5.0f} J, largest torque {torque:3.0f} % of its peak limit")
