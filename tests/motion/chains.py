"""Random chains of blended moves that several test modules share."""

import numpy as np

from robojoule.motion.corners import Chain

ROBOTS = ("kuka_kr16_r2010_2", "fanuc_m20_25_18d", "ur_ur10e")
LEGS = (2, 3, 4, 6, 9, 1)


def random_points(robot, legs, seed, sizes=(0.1, 1.0, 1.5)):
    rng = np.random.default_rng(seed)
    steps = rng.normal(0.0, 0.4, (legs + 1, robot.joint_count)) * rng.choice(sizes, (legs + 1, 1))
    return np.clip(robot.home_rad + np.cumsum(steps, axis=0), robot.lower_rad, robot.upper_rad)


def random_chain(robot, legs, seed):
    rng = np.random.default_rng(seed + 1000)
    radius = np.where(rng.random(legs - 1) < 0.7, 10.0 ** rng.uniform(-3, -0.5, legs - 1), np.inf)
    return Chain(random_points(robot, legs, seed), radius, rng.choice([0.1, 0.3, 0.5], legs - 1))


def random_chains(robot):
    return [random_chain(robot, legs, seed) for seed, legs in enumerate(LEGS)]
