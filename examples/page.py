"""A page to look at, `saving.html`, with the kWh, cost and CO2 of a year in three shifts in Czechia."""

import robojoule as rj
from robojoule.year import Operation

robot = rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)
program = rj.load_program("cycle.yaml")
plan = rj.optimize(program, robot, cycle_time="+10%")

page = rj.report(plan, program, robot, operation=Operation.of(shifts=3, country="CZE", price_per_kwh=0.15))
page.save("saving.html")
print(
    f"{page.yearly.saved_kwh:.0f} kWh, {page.yearly.saved_cost:.0f} EUR, {page.yearly.saved_co2_kg:.0f} kg CO2 a year"
)
