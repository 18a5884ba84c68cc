"""The program that several commands are tried on."""

import numpy as np
import pytest

from robojoule.formats.tree_files import save_tree
from robojoule.programs.operation_tree import tree_from_configurations


@pytest.fixture(scope="session")
def program(tmp_path_factory):
    degrees = [[0, -90, 90, 0, 0, 0], [50, -70, 80, 0, 30, 0], [-20, -60, 100, 40, 0, 0], [0, -90, 90, 0, 0, 0]]
    path = tmp_path_factory.mktemp("programs") / "pick.yaml"
    save_tree(tree_from_configurations("pick", np.radians(degrees), "kuka_kr16_r2010_2"), path)
    return path
