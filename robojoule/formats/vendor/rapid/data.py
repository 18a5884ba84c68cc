"""Data of RAPID: what the controller predefines, and records as placements, payloads and targets.

Records are lists of their components, as aggregates give them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.formats.vendor.values import Number, Value, number
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload

NOT_USED = 9e8  # from there on a position of an external axis is none (9E9)
EXTERNAL = ("eax_a", "eax_b", "eax_c", "eax_d", "eax_e", "eax_f")
_SPEEDS_MM_S = (
    *(5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800),
    *(1000, 1500, 2000, 2500, 3000, 4000, 5000, 6000, 7000),
)
ZONES_MM = {0: 0.3, **{n: float(n) for n in (1, 5, 10, 15, 20, 30, 40, 50, 60, 80, 100, 150, 200)}}
_MM = 1e-3
# Places of components in their records; `extax` is the last one of targets of both kinds.
_COMPONENTS = {
    **{name: place for place, name in enumerate(("trans", "rot", "robconf"))},
    **{name: place for place, name in enumerate(("x", "y", "z"))},
    **{name: place for place, name in enumerate(("q1", "q2", "q3", "q4"))},
    **{name: place for place, name in enumerate(("cf1", "cf4", "cf6", "cfx"))},
    **{name: place for place, name in enumerate(EXTERNAL)},
    **{f"rax_{joint}": joint - 1 for joint in range(1, 7)},
    **{"robax": 0, "robhold": 0, "tframe": 1, "tload": 2, "mass": 0, "cog": 1, "aom": 2, "ix": 3, "iy": 4, "iz": 5},
    **{"ufprog": 1, "ufmec": 2, "uframe": 3, "oframe": 4, "v_tcp": 0, "v_ori": 1, "v_leax": 2, "v_reax": 3},
    **{"finep": 0, "pzone_tcp": 1, "pzone_ori": 2, "pzone_eax": 3, "zone_ori": 4, "zone_leax": 5, "zone_reax": 6},
}


def component(name: str, record: Sequence[Value]) -> int | None:
    """Place of a component in a record; None: it has none of that name."""
    place = len(record) - 1 if name.lower() == "extax" else _COMPONENTS.get(name.lower())
    return place if place is not None and place < len(record) else None


def predefined() -> dict[str, Value]:
    """Data that every controller has, by names in capitals."""
    pose = [_numbers(0, 0, 0), _numbers(1, 0, 0, 0)]
    load = [Number(0.001), _numbers(0, 0, 0.001), _numbers(1, 0, 0, 0), *_numbers(0, 0, 0)]
    return {
        **{f"V{speed}": _numbers(speed, 500, 5000, 1000) for speed in _SPEEDS_MM_S},
        **{f"Z{zone}": _zone(radius_mm) for zone, radius_mm in ZONES_MM.items()},
        "VMAX": _numbers(5000, 500, 5000, 1000),
        "FINE": [True, *_numbers(0, 0, 0, 0, 0, 0)],
        "TOOL0": [True, pose, load],
        "LOAD0": load,
        "WOBJ0": [False, True, "", pose, pose],
        "PI": Number(math.pi),
        "ON": True,
        "OFF": False,
        "HIGH": Number(1.0),
        "LOW": Number(0.0),
    }


def _zone(radius_mm: float) -> Value:
    wide, narrow = 1.5 * radius_mm, 0.15 * radius_mm
    return [False, *_numbers(radius_mm, wide, wide, narrow, wide, narrow)]


def _numbers(*values: float) -> list[Value]:
    return [Number(float(value)) for value in values]


def floats(values: Value, count: int) -> list[float] | None:
    """The numbers of a record of so many; None: it is another one, or one of them is not known."""
    if not isinstance(values, list) or len(values) != count:
        return None
    found = [number(value) for value in values]
    known = [value for value in found if value is not None]
    return known if len(known) == count else None


def rotation_of(value: Value) -> Array | None:
    """Rotation, shape (3, 3), of an orient, whose quaternion need not be of length 1. [-]"""
    quaternion = floats(value, 4)
    if quaternion is None or (length := math.hypot(*quaternion)) < 1e-6:
        return None
    w, x, y, z = (part / length for part in quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def pose_of(value: Value) -> Placement | None:
    """A pose as a placement; None: it is not known. [m]"""
    if not isinstance(value, list) or len(value) != 2:
        return None
    origin, rotation = floats(value[0], 3), rotation_of(value[1])
    return None if origin is None or rotation is None else Placement(rotation, np.array(origin) * _MM)


def tool_of(value: Value) -> Placement | None:
    """The frame of a tooldata on the flange; None: it is not known, or the robot does not hold the tool. [m]"""
    is_held = isinstance(value, list) and len(value) == 3 and value[0] is True
    return pose_of(value[1]) if is_held else None


def work_object_of(value: Value) -> Placement | None:
    """The frame of a wobjdata in the robot's base; None: it is not known, or moves. [m]"""
    if not isinstance(value, list) or len(value) != 5 or value[0] is not False or value[1] is not True:
        return None
    user, own = pose_of(value[3]), pose_of(value[4])
    return None if user is None or own is None else user @ own


def payload_of(value: Value) -> Payload | None:
    """A loaddata as a payload in the flange's frame; None: it is not known."""
    if not isinstance(value, list) or len(value) != 6:
        return None
    mass, center, inertia = number(value[0]), floats(value[1], 3), floats(value[3:], 3)
    if mass is None or center is None or mass < 0.0:
        return None
    try:
        # An inertia of zeros says that the load is taken for a point mass.
        return Payload(mass, tuple(part * _MM for part in center), inertia if inertia and any(inertia) else None)  # type: ignore[arg-type]
    except InputError:
        return None
