"""Published figures of drives: the anchors of the scaling laws, and the KR300 that was measured."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated

from pydantic import Field

from robojoule.documents import Document, load

Six = Annotated[list[float], Field(min_length=6, max_length=6)]
Vector = tuple[float, float, float]


class DhTable(Document):
    """Standard Denavit-Hartenberg parameters: rotz(theta + offset) transz(d) transx(a) rotx(alpha)."""

    d_m: Six
    a_m: Six
    alpha_rad: Six
    offset_rad: Six


class FrictionFigures(Document):
    """Friction on the link side: asymmetry + viscous qd + coulomb sign(qd) + tanh_nm tanh(tanh_slope qd)."""

    asymmetry_nm: Six
    viscous_nm_s_per_rad: Six
    coulomb_nm: Six
    tanh_nm: Six
    tanh_slope_s_per_rad: Six


class CounterbalanceFigures(Document):
    """Nitrogen spring that acts on joint 2."""

    pivot_to_anchor_m: float
    pivot_to_rod_m: float
    piston_diameter_m: float
    rod_diameter_m: float
    nitrogen_kg: float
    volume_m3: float
    compressibility: float
    gas_constant_j_per_kg_k: float
    temperature_k: float
    zero_deg: float


class RunFigures(Document):
    """What the recorded runs carry, and the pose that their positions count from."""

    payload_kg: float
    payload_com_m: Vector
    payload_note: str
    position_zero_deg: Six
    position_note: str


class Kr300(Document):
    """Identified figures of a KUKA KR300 R2500 ultra; source and licence stand in the file."""

    robot: str
    source: str
    license: str
    convention: str
    dh: DhTable
    mass_kg: Six
    com_m: list[Vector]
    inertia_kg_m2_xx_yy_zz_xy_yz_xz: list[Six]
    rotor_inertia_kg_m2: Six
    gear_ratio: Six
    runs: RunFigures
    position_limits_deg: list[tuple[float, float]]
    identified_up_to_deg_per_s: float
    rated_payload_kg: float
    friction_law: str
    friction: FrictionFigures
    counterbalance_law: str
    counterbalance: CounterbalanceFigures


class CobotAnchors(Document):
    """Anchors of the collaborative arms."""

    names: list[str]
    friction_of: str
    coulomb_nm: Six
    viscous_nm_s_per_rad: Six
    gear_ratio: float
    arm_power_w: float
    arm_power_range_w: tuple[float, float]
    drive_active_power_w: float
    bus_efficiency: float
    controller_power_w: float
    controller_power_range_w: tuple[float, float]
    supply_efficiency: float
    supply_efficiency_range: tuple[float, float]


class AnchorFile(Document):
    """`anchors.yaml`: what the scaling laws stand on."""

    fitted: str
    fitted_idle_w: float
    large_idle_w: float
    large: str
    copper_share: Annotated[float, Field(gt=0)]
    kr300_between: tuple[str, str]
    counterbalanced: list[str]
    cobots: CobotAnchors


def _path(name: str) -> Path:
    return Path(str(resources.files("robojoule.robots") / "anchors" / name))


def load_kr300() -> Kr300:
    """Figures of the measured KR300."""
    return load(Kr300, _path("kr300.json"))


def load_anchors() -> AnchorFile:
    """Anchors of the scaling laws."""
    return load(AnchorFile, _path("anchors.yaml"))
