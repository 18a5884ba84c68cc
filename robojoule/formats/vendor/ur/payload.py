"""The payload as URScript's functions set it, one figure at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from robojoule.errors import InputError
from robojoule.formats.vendor.ur.expressions import numbers_in
from robojoule.formats.vendor.values import Value, number
from robojoule.robots.robot import Payload

PARAMETERS = {
    "set_payload": ("m", "cog"),
    "set_target_payload": ("m", "cog", "inertia"),
    "set_payload_mass": ("m",),
    "set_payload_cog": ("CoG",),
}


@dataclass
class Carried:
    """What the robot carries.

    Attributes:
        mass_kg: Its mass; None: not known. [kg]
        center_m: Its centre of mass in the flange's frame; None: not known. [m]
    """

    mass_kg: float | None = None
    center_m: tuple[float, ...] | None = None

    def set(self, name: str, given: Mapping[str, Value]) -> tuple[Payload | None, str]:
        """Set the payload, or one of its figures.

        Args:
            name: The function that is called, one of `PARAMETERS`.
            given: Its parameters.

        Returns:
            The payload, None if it is not known, and what is assumed of it, empty if nothing is.
        """
        remark = ""
        if "m" in PARAMETERS[name]:
            self.mass_kg = number(given.get("m"))
        center = given.get("CoG" if name == "set_payload_cog" else "cog", ())
        if name == "set_payload_mass" or center == ():
            keeps = name == "set_payload_mass" and self.center_m is not None
            if not keeps:
                self.center_m, remark = (0.0, 0.0, 0.0), "its centre of mass is taken to be at the flange"
        else:
            self.center_m = numbers_in(center, 3)
        inertia = given.get("inertia", ())
        moments = numbers_in(inertia, 6)
        if inertia != () and moments is None:
            remark = "its inertia is not known: taken as that of a compact body"
        return self._payload(moments), remark

    def _payload(self, moments: tuple[float, ...] | None) -> Payload | None:
        if self.mass_kg is None or self.center_m is None:
            return None
        x, y, z = self.center_m
        try:
            return Payload(self.mass_kg, (x, y, z), moments if moments is not None and any(moments) else None)
        except InputError:
            return None
