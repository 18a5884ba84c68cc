"""The energy of one motion over its duration, and where it goes."""

import robojoule as rj

robot = rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)
profile = rj.energy_profile(robot, [0, -90, 90, 0, 0, 0], [45, -60, 70, 0, 30, 0], degrees=True)

print("speed limit  duration  energy  of that in braking")
for k, limit in enumerate(profile.speed_limits):
    braking_j = profile.parts_j["braking_j"][k]
    print(f"{100 * limit:9.0f} %  {profile.durations_s[k]:6.2f} s  {profile.energies_j[k]:4.0f} J  {braking_j:4.0f} J")
best = profile.optimal_speed_limit_percent
print(f"least energy at {best:.0f} %: {profile.energy_saving_j:.0f} J less than at full speed")
