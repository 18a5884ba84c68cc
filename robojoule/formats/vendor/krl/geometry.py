"""Frames of KRL: X, Y, Z in mm and A, B, C in degrees, as turns about z, the new y and the new x."""

from __future__ import annotations

import math
from collections.abc import Mapping

from robojoule.formats.vendor.values import Number, Value, numbers
from robojoule.robots.rigid_body import Placement


def frame_of(value: Value) -> Placement | None:
    """A FRAME as a placement, what it leaves out being zero; None where it is not known."""
    found = numbers(value, "X", "Y", "Z", "A", "B", "C") if isinstance(value, Mapping) else None
    if found is None:
        return None
    x, y, z, a, b, c = (one or 0.0 for one in found)
    return Placement.of((x / 1e3, y / 1e3, z / 1e3), (math.radians(c), math.radians(b), math.radians(a)))


def fields_of(placement: Placement) -> dict[str, Number]:
    """A placement as a FRAME."""
    r = placement.rotation
    b = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0]))
    if abs(math.cos(b)) > 1e-9:
        a, c = math.atan2(r[1, 0], r[0, 0]), math.atan2(r[2, 1], r[2, 2])
    else:  # A and C turn about the same axis: C is taken as zero
        a, c = math.atan2(-r[0, 1], r[1, 1]), 0.0
    x, y, z = (1e3 * value for value in placement.origin_m.tolist())
    names = {"X": x, "Y": y, "Z": z, "A": math.degrees(a), "B": math.degrees(b), "C": math.degrees(c)}
    return {name: Number(value) for name, value in names.items()}


def joined(first: Value, second: Value) -> Value:
    """The geometric operator: a frame or position in another one; None where one of them is not known."""
    outer, inner = frame_of(first), frame_of(second)
    if outer is None or inner is None:
        return None
    kept = {name: value for name, value in second.items() if name not in ("X", "Y", "Z", "A", "B", "C")}
    return {**kept, **fields_of(outer @ inner)}
