"""How trees are sorted into sets."""

import numpy as np
import pytest

from reproduction.trees.sets import complexity_terciles, split_by_tree


@pytest.mark.parametrize(
    ("trees", "fraction", "tests"),
    [(600, 0.2, 120), (2, 0.2, 1), (2, 0.9, 1), (3, 0.01, 1), (10, 0.99, 9)],
)
def test_split_sizes(trees, fraction, tests):
    splits = split_by_tree(np.random.default_rng(0), trees, fraction)
    assert (splits.count("test"), splits.count("train")) == (tests, trees - tests)


@pytest.mark.parametrize(
    ("travels", "expected"),
    [
        ([3.0, 1.0, 2.0], ["complex", "simple", "medium"]),
        ([1.0, 1.0, 1.0], ["simple", "medium", "complex"]),
        ([1, 2, 3, 4, 5, 6, 7], ["simple"] * 3 + ["medium"] * 2 + ["complex"] * 2),
    ],
)
def test_terciles(travels, expected):
    assert complexity_terciles(travels) == expected
