"""The methods of the experiment by name."""

from pathlib import Path

import numpy as np

from reproduction.config import load_params
from reproduction.methods.registry import METHODS, Knowledge
from reproduction.report.labels import METHODS as LABELS

PARAMS = Path(__file__).parents[3] / "params.yaml"


def test_every_variant_is_found_under_the_name_of_its_method_and_has_a_label():
    settings = load_params(PARAMS).evaluate_plans
    known = Knowledge([], 10, np.zeros(0), np.zeros((0, 3)), None)
    found = {name: [method.variant for method in variants(known, settings)] for name, variants in METHODS.items()}
    assert list(found) == list(LABELS)
    for name, variants in found.items():
        assert {variant.method for variant in variants} == {name}
    assert [(v.krc_segments, v.point_spacing) for v in found["krc_polynomial"]] == [
        (4, "speed"),
        (6, "speed"),
        (4, "duration"),
        (6, "duration"),
    ]
    everything = [variant for variants in found.values() for variant in variants]
    assert len(set(everything)) == len(everything)
