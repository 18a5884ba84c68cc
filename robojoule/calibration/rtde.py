"""Logs as the real-time interface of a Universal Robots controller names them.

`timestamp`, `actual_q_0 ..`, `actual_qd_0 ..`, `actual_current_0 ..` (motor currents), `actual_robot_voltage` and
`actual_robot_current`, whose product is the power on the bus that feeds the arm, and `target_speed_fraction`, the speed
slider. Other columns are left out.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from robojoule.arrays import Array
from robojoule.calibration.log_table import LogTable

TIME = "timestamp"
_POWER = ("actual_robot_voltage", "actual_robot_current")
_SLIDER = "target_speed_fraction"
_JOINTS = re.compile(r"actual_(qd?|current)_(\d+)")
_QUANTITIES = {"q": "rad", "qd": "velocity_rad_s", "current": "current_a"}


def is_rtde(table: LogTable) -> bool:
    """Whether a table has the names of that interface."""
    return TIME in table.names and any(_JOINTS.fullmatch(name) for name in table.names)


def with_own_names(table: LogTable, *, with_currents: bool) -> LogTable:
    """The table by the names of `robojoule.calibration.log`.

    Args:
        table: Table by the names of that interface.
        with_currents: Whether motor currents are wanted; they come in every such log, asked for or not.
    """
    places: list[Callable[[], Array]] = []
    names: list[str] = []

    def add(name: str, *columns: str, factor: float = 1.0) -> None:
        def product() -> Array:
            values = factor * table.column(columns[0])
            for column in columns[1:]:
                values = values * table.column(column)
            return values

        names.append(name)
        places.append(product)

    add("time_s", TIME)
    for name in table.names:
        match = _JOINTS.fullmatch(name)
        if match is not None and (with_currents or match[1] != "current"):
            add(f"q{int(match[2]) + 1}_{_QUANTITIES[match[1]]}", name)
    if set(_POWER) <= set(table.names):
        add("power_w", *_POWER)
    if _SLIDER in table.names:
        add("speed_limit_percent", _SLIDER, factor=100.0)
    return LogTable(
        table.source,
        tuple(names),
        lambda place: places[place](),
        lambda place: [str(value) for value in places[place]()],
    )
