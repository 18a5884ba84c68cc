"""Accuracy over several machines: the tables of docs/identification.md.

Run with `python -m tests.calibration.accuracy` (some minutes).
"""

import json
import tempfile
from pathlib import Path

import numpy as np

from robojoule.calibration.identification import identify
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload
from tests.calibration.plant import Plant, as_log, judge, make_log

SEEDS = (1, 2, 3, 4, 5)
MOTIONS = 100
CASES = {
    "nothing unmodelled, no noise": ({"inertia_error": 0.0, "load_friction": 0.0}, {"noise": 0.0, "encoder_rad": 0.0}),
    "noise only": ({"inertia_error": 0.0, "load_friction": 0.0}, {}),
    "reference": ({}, {}),
    "reference, irregular stamps": ({}, {"jitter": 0.45}),
    "reference, 100 Hz": ({}, {"rate_hz": 100.0}),
    "reference, encoder steps of 1e-4 rad": ({}, {"encoder_rad": 1e-4}),
    "reference, joint torques logged": ({}, {"torques": True}),
    "reference, 60 % regeneration": ({"regeneration": 0.6}, {}),
    "reference, twice the load friction": ({"load_friction": 0.06}, {}),
    "reference, 30 motions only": ({}, {"motions": 30}),
    "reference, UR10e": ({"name": "ur_ur10e"}, {}),
}


def main():
    """Print one table row per case: worst over the seeds, and the mean RMSE."""
    print("| case | RMSE mean / worst [%] | energy of all motions, worst [%] | motions within 2 % | worst motion [%] |")
    print("|---|---|---|---|---|")
    for title, (hidden, options) in CASES.items():
        rmse, total, each = [], [], []
        for seed in SEEDS:
            plant = Plant(seed, **hidden)
            columns, _ = make_log(plant, seed, **{"motions": MOTIONS, **options})
            result = identify(as_log(columns), load_robot(plant.name, Payload(10.0)))
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "entry.json"
                path.write_text(json.dumps(result.robot_file().model_dump(mode="json")))
                identified = load_robot(path, Payload(10.0))
            one = judge(plant, identified, 1000 + seed, motions=40)
            rmse.append(one[0])
            total.append(abs(one[1]))
            each.append(np.abs(one[2]))
        motions = np.concatenate(each)
        within = 100.0 * np.mean(motions <= 2.0)
        row = f"{np.mean(rmse):.2f} / {max(rmse):.2f} | {max(total):.2f} | {within:.1f} % | {motions.max():.1f}"
        print(f"| {title} | {row} |", flush=True)


if __name__ == "__main__":
    main()
