"""Cycle times as users give them."""

import numpy as np
import pytest

from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.planning.cycle_time import cycle_time_s

GOOD = {
    "number": (7.5, 7.5),
    "whole number": (8, 8.0),
    "numpy": (np.float64(7.5), 7.5),
    "text": ("7.5", 7.5),
    "share": ("+10%", 6.6),
    "spaces": (" +10 % ", 6.6),
    "no more": ("+0%", 6.0),
    "faster than the program": (5.5, 5.5),
    "rounded down": (5.0 - 4e-7, 5.0),
}


@pytest.mark.parametrize("asked, expected", GOOD.values(), ids=GOOD.keys())
def test_seconds_or_a_share_of_the_program(asked, expected):
    assert cycle_time_s(asked, given_s=6.0, least_s=5.0) == pytest.approx(expected, rel=1e-15)


BAD = [
    "fast",
    "",
    "10%",
    "-10%",
    "+10",
    "+-1%",
    "1e400",
    "nan",
    float("nan"),
    float("inf"),
    0,
    "0",
    -3,
    None,
    True,
    [7.5],
]


@pytest.mark.parametrize("asked", BAD, ids=str)
def test_anything_else_is_refused(asked):
    with pytest.raises(InputError) as caught:
        cycle_time_s(asked, given_s=6.0, least_s=5.0)
    allowed = "allowed: seconds (7.5), or a share above the program's own cycle time (+10%)"
    assert str(caught.value) == f"cycle_time: {asked!r} is not a valid cycle time; {allowed}"


@pytest.mark.parametrize("asked", ["+\uff11\uff10%", "1_0", b"+10%", {}, 10**400, -(10**400)], ids=ascii)
def test_what_only_looks_like_a_number_is_refused(asked):
    with pytest.raises(InputError, match="is not a valid cycle time"):
        cycle_time_s(asked, given_s=6.0, least_s=5.0)


@pytest.mark.parametrize("asked", [1e9, "1e9", "86401", "+1e308%", "+2000000%"])
def test_longer_than_a_day_is_refused(asked):
    with pytest.raises(InputError, match=r"is too long for a cycle; allowed: at most 86400 s"):
        cycle_time_s(asked, given_s=6.0, least_s=5.0)


def test_too_short_a_cycle_names_the_least_one():
    with pytest.raises(CycleTimeTooShort, match=r"at least 5\.000000 s") as caught:
        cycle_time_s("4.99", given_s=6.0, least_s=5.0)
    assert (caught.value.requested_s, caught.value.minimum_s) == (4.99, 5.0)
