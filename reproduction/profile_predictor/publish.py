"""Put the pipeline's profile predictor into the library: `python -m reproduction.profile_predictor.publish`.

Copies `models/profile_predictor`, as the stage `train_profile_predictor` left it, to where
`robojoule.profile.reference` finds it, to be committed; refuses one that was trained for another entry than
the catalog's present one.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from robojoule.profile.predictor_file import load_profile_predictor, save_profile_predictor
from robojoule.profile.reference import TRAINED
from robojoule.robots import load_robot


def publish_predictor(trained: Path, to: Path) -> Path:
    """Read a trained predictor, check it and write it below `to`.

    Args:
        trained: Folder of the trained predictor.
        to: Folder of the published predictors.

    Returns:
        The folder that was written.

    Raises:
        InputError: The folder holds no predictor, or one of another entry than the catalog's.
    """
    predictor = load_profile_predictor(trained)
    predictor.check_entry(load_robot(predictor.robot))
    folder = to / predictor.robot
    save_profile_predictor(predictor, folder)
    return folder


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", type=Path, default=Path("models/profile_predictor"), help="folder of the predictor")
    print(f"published: {publish_predictor(parser.parse_args().model, TRAINED)}")


if __name__ == "__main__":
    main()
