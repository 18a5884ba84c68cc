"""Drawings of single results hold what they should and have the same bytes each time."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

import robojoule as rj
from robojoule.formats.program import Program
from robojoule.plots import energy, pareto, style
from robojoule.programs.operation_tree import tree_from_configurations
from tests.core_cases import HOME_DEG, kr16

END_DEG = (60, -60, 90, 0, 30, 0)


@pytest.fixture(scope="module")
def drawings():
    """Each drawing, made twice."""
    robot = kr16()
    profile = rj.energy_profile(robot, HOME_DEG, END_DEG, degrees=True, points=7)
    program = Program(tree_from_configurations("swing", np.radians([HOME_DEG, END_DEG, HOME_DEG])))
    curve = rj.pareto(program, robot).to_dict(until="waiting")
    return {
        "energy": [energy.drawing_of(profile) for _ in range(2)],
        "pareto": [pareto.drawing_of(curve) for _ in range(2)],
    }


@pytest.mark.parametrize("name", ["energy", "pareto"])
def test_a_drawing_is_the_same_each_time(drawings, name):
    first, second = drawings[name]
    assert first == second
    assert ET.fromstring(first).tag.endswith("svg")
    assert "<dc:date>" not in first and "dc:creator" not in first


def test_used_parts_are_those_that_are_not_zero():
    rows = {part: np.array([0.0, 1.0 if part in ("base_j", "friction_j") else 0.0]) for part in style.ENERGY_PARTS}
    assert style.used_parts(rows) == ["base_j", "friction_j"]
