"""See what longer cycle times of cycle.yaml save, to choose one, and where more time saves nothing more."""

import robojoule as rj

robot = rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)

# Least energy over all cycle times, from the fastest cycle on.
curve = rj.pareto(rj.load_program("cycle.yaml"), robot).curve
fastest_s, fastest_j = curve.cycle_times_s[0], curve.energies_j[0]

print("cycle time  energy of a cycle")
for percent in (100, 105, 110, 120, 130, 150):
    time_s = fastest_s * percent / 100
    print(f"{time_s:8.2f} s  {curve.energy_j(time_s):8.0f} J")

best_s, best_j = curve.cycle_times_s[curve.best], curve.energies_j[curve.best]
print(f"least energy: {best_j:.0f} J at {best_s:.2f} s, {100 * (1 - best_j / fastest_j):.1f} % below the fastest cycle")
