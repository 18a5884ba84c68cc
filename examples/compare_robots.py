"""The same program on several robots: how fast each is, and what the fastest and the best cycle take."""

import robojoule as rj

program = rj.load_program("cycle.yaml")

for name in ("kuka_kr10_r1100_2", "kuka_kr16_r2010_2", "kuka_kr20_r1810_2", "ur_ur10e"):
    robot = rj.load_robot(name, payload_kg=5)
    curve = rj.pareto(program, robot).curve
    fastest, best = curve.energies_j[0], curve.energies_j[curve.best]
    print(f"{name:20}  fastest {curve.cycle_times_s[0]:.2f} s, {fastest:5.0f} J", end="  ")
    print(f"best {curve.cycle_times_s[curve.best]:.2f} s, {best:5.0f} J ({100 * (1 - best / fastest):.0f} % less)")
