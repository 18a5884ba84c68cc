"""A copy of the project with parameters for a few trees, in a Git repository of its own."""

import shutil
import subprocess
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parent.parent

# What the toy project takes beside the code.
COPIED = (
    *(".dvc/config", ".dvc/.gitignore", ".dvcignore", ".gitignore", "reports/.gitignore"),
    *(f"{folder}/{name}" for folder in ("data", "models") for name in (".gitignore", "README.md")),
    *("dvc.yaml", "versions.yaml", "prefect.yaml", "pyproject.toml", "desk.env", "studies/dvc.lock"),
    *("studies/dvc.yaml", "studies/params.yaml"),
)

TOY_PARAMS = {
    "generate_trees": {"trees": 6, "test_fraction": 0.34, "experiment_trees": 3, "points": 2, "budget_rad": [1.0, 3.0]},
    "simulate_motions": {"speed_limits_percent": [10, 25, 40, 55, 70, 85, 100], "shard_motions": 20},
    "train_predictors": {"random_forest": {"n_estimators": 8}, "neural_network": {"max_epochs": 30}},
    "evaluate_plans": {
        "relaxations_percent": [110, 150],
        "dense_speed_limits": 90,
        "payload_sensitivity_kg": [10],
    },
}


def merge(base: dict, changes: dict) -> dict:
    """`base` with the leaves of `changes` in place."""
    result = dict(base)
    for key, value in changes.items():
        result[key] = merge(base[key], value) if isinstance(value, dict) else value
    return result


def make_toy(folder: Path) -> Path:
    """Make the copy; returns its folder."""
    folder.mkdir()
    for name in ("robojoule", "reproduction", "stages", "flows"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "studies/tables", folder / "studies/tables")
    for name in COPIED:
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    params = merge(yaml.safe_load((ROOT / "params.yaml").read_text(encoding="utf-8")), TOY_PARAMS)
    (folder / "params.yaml").write_text(yaml.safe_dump(params, sort_keys=False), encoding="utf-8")
    commands = (
        ["init", "-q"],
        ["add", "-A"],
        ["-c", "user.name=toy", "-c", "user.email=toy@example.org", "commit", "-qm", "Toy"],
    )
    for words in commands:
        subprocess.run(["git", *words], cwd=folder, check=True)
    return folder
