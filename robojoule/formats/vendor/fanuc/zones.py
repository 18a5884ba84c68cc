"""How far from its target a motion of a teach pendant program may be when the next one begins."""

from __future__ import annotations

from lark import Token

from robojoule.formats.vendor.fanuc.registers import Registers
from robojoule.formats.vendor.fanuc.syntax import Node
from robojoule.formats.vendor.trace import Blend
from robojoule.formats.vendor.zones import ASSUMED_BLEND


def blend_of(tree: Node, registers: Registers) -> Blend | None:
    """CNT as a share of the half way: FANUC does not say more of it than that 100 is the roundest.

    Returns:
        None: the robot stops. `ASSUMED_BLEND`: a register says how far, and it is not known.
    """
    for ending in tree.find_data("ending"):
        tokens = [token for token in ending.children if isinstance(token, Token)]
        if tokens[0].type == "FINE":
            return None
        value = registers.amount(str(tokens[1]))
        if value is None:
            return ASSUMED_BLEND
        if tokens[0].type == "CR":
            return Blend(radius_m=value * 1e-3) if value > 0.0 else None
        share = min(value, 100.0) / 100.0
        return Blend(share=share) if share > 0.0 else None
    return None
