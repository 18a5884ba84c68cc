"""What people hand over: numbers, paths, names; how messages show it."""

import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from robojoule.arrays import as_array
from robojoule.errors import LONGEST_MESSAGE, InputError
from robojoule.inputs import as_number, as_path, as_whole, counted, number_of, real, shown, unknown_name


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2.0), np.int64(2), Fraction(2)], ids=lambda v: type(v).__name__)
def test_every_real_number_is_one(value):
    assert real(value) == as_number(value, "key", least=2, most=2, unit="s") == 2.0


@pytest.mark.parametrize("value", [None, True, np.True_, "2", b"2", 2j, [2], np.ones(1)], ids=repr)
def test_nothing_else_is_a_number(value):
    assert math.isnan(real(value))
    with pytest.raises(InputError, match=r"^key: .* is not a finite number; allowed: 0 to 3 s$"):
        as_number(value, "key", least=0, most=3, unit="s")


def test_an_integer_beyond_floats_is_infinite():
    assert real(10**400) == math.inf
    assert real(-(10**400)) == math.inf
    assert shown(10**5000) == shown(-(10**5000)) == "a number without bounds"


@pytest.mark.parametrize("text, value", [("7.5", 7.5), (" -1e3 ", -1000.0), ("0", 0.0)])
def test_numbers_in_text(text, value):
    assert number_of(text) == value


@pytest.mark.parametrize("text", ["", "x", "1_0", "\uff11\uff10", "\u0663", "1,5", "nan", "inf", "1e400"], ids=ascii)
def test_what_is_not_a_number_in_text(text):
    with pytest.raises(ValueError, match=r"is not a (finite )?number"):
        number_of(text)


@pytest.mark.parametrize("value", ["a/b.yaml", Path("a/b.yaml")])
def test_paths(value):
    assert as_path(value, "key") == Path("a/b.yaml")


@pytest.mark.parametrize(
    "value", [None, 5, b"a.yaml", ["a.yaml"], object(), "", "a\0.yaml"], ids=lambda value: type(value).__name__
)
def test_what_names_no_file(value):
    with pytest.raises(InputError, match=r"key: .*(is not the name of a file|no file can have this name)"):
        as_path(value, "key")


BAD_ARRAYS = {
    "words": ["a", "b"],
    "numbers as text": ["1", "2"],
    "booleans": [True, False],
    "a boolean among numbers": [1.0, True],
    "ragged": [[1.0], [1.0, 2.0]],
    "complex": [1j, 2.0],
    "integers beyond floats": [10**400, 1],
    "nothing": None,
    "set": {1.0, 2.0},
}


@pytest.mark.parametrize("values", BAD_ARRAYS.values(), ids=BAD_ARRAYS.keys())
def test_what_is_no_array(values):
    with pytest.raises(InputError, match=r"^q: joint positions must be numbers$"):
        as_array(values, "q", "joint positions")


def test_arrays_are_floats():
    assert as_array([[1, 2], (3, 4)], "q", "numbers").tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert as_array([1, 2], "q", "numbers").dtype == np.float64


def test_one_is_singular():
    assert [counted(n, "motion") for n in (0, 1, 2)] == ["0 motions", "1 motion", "2 motions"]


def test_near_names_are_offered_and_others_not():
    known = ["optimize", "pareto"]
    assert str(unknown_name("command", "optimise", known)) == (
        "unknown command 'optimise' (did you mean optimize?); allowed: optimize, pareto"
    )
    assert "did you mean" not in str(unknown_name("command", "x", known))
    assert "did you mean" not in str(unknown_name("command", "", known))


HOSTILE = "a\nb\x1b[31m\0\ud800\u2028" * 200


@pytest.mark.parametrize("place", ["problem", "file", "key", "allowed"])
def test_messages_are_one_short_printable_line(place):
    parts = {"problem": "it is wrong", "file": "file.yaml", "key": "key", "allowed": "what is right"}
    error = InputError(**{**parts, place: HOSTILE})
    assert str(error).isprintable()
    assert len(str(error)) <= LONGEST_MESSAGE + len(", : ; allowed: ")
    for name, text in parts.items():
        assert name == place or text in str(error)
        assert getattr(error, name) == (HOSTILE if name == place else text)


def test_a_long_path_is_cut_before_what_is_wrong():
    error = InputError(
        "it is wrong " * 8, file="folder/" * 40 + "arm.yaml", key="joint_1", allowed="what is right " * 5
    )
    assert "it is wrong " * 8 in str(error)
    assert "arm.yaml, joint_1: " in str(error)


def test_values_of_any_kind_are_shown_short():
    loop: list[object] = []
    loop.append(loop)
    for value in ("x" * 1000, list(range(1000)), loop, {"a": 10**5000}, np.zeros((9, 9)), object()):
        assert len(shown(value)) <= 60
        assert "\n" not in shown(value)


def test_whole_numbers_are_not_cut():
    assert as_whole(3.0, "key", least=0, most=9) == 3
    with pytest.raises(InputError, match=r"key: 1\.5 is not a whole number; allowed: 0 to 9"):
        as_whole(1.5, "key", least=0, most=9)
