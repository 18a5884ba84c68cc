"""Plans of all programs in a folder for a tenth more time, in a folder `planned`, and what they save as a table."""

from pathlib import Path

import robojoule as rj

robot = rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)
planned = Path("planned")
planned.mkdir(exist_ok=True)

print("program,cycle_time_s,energy_given_j,energy_j,saving_percent")
for path in sorted(Path().glob("*.yaml")):
    plan = rj.optimize(rj.load_program(path), robot, cycle_time="+10%")
    plan.save(planned / path.name)
    print(
        f"{path.name},{plan.cycle_time_s:.3f},{plan.energy_given_j:.1f},{plan.energy_j:.1f},{plan.saving_percent:.2f}"
    )
