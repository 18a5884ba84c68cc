"""Figures of a machine's drives as one vector of parameters, whatever they are estimated from.

A log, single runs and published figures need different methods, but the same vector: entries in groups, a group being
one figure of `DriveParameters`, either one that all joints share or one entry per joint. Each figure is

    figure = unit . f(x) ,   f(x) = x, 1 / x, exp(x), exp(-x) or a share x of a range ,

so that what must be positive is positive, what scales from arm to arm is scaled, and what enters the energy as a
reciprocal is estimated as one. Behind the drives' entries a vector may hold coordinates of inertial directions (see
`robojoule.calibration.inertial`), which are of variance 1 by themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array
from robojoule.motion.path_integrals import INERTIAL
from robojoule.robots.drives import DriveParameters, Gradient


@dataclass(frozen=True)
class Transform:
    """How an entry x of the vector makes a figure over its unit.

    Attributes:
        value: Figure over unit from x.
        inverse: x from figure over unit.
        slope: Derivative of `value` at x.
    """

    value: Callable[[Array], Array]
    inverse: Callable[[Array], Array]
    slope: Callable[[Array], Array]


IDENTITY = Transform(value=lambda x: x, inverse=lambda y: y, slope=np.ones_like)
RECIPROCAL = Transform(value=lambda x: 1.0 / x, inverse=lambda y: 1.0 / y, slope=lambda x: -1.0 / x**2)
LOG_RATIO = Transform(value=np.exp, inverse=np.log, slope=np.exp)
LOG_RECIPROCAL = Transform(value=lambda x: np.exp(-x), inverse=lambda y: -np.log(y), slope=lambda x: -np.exp(-x))


def share_of_range(low: float, high: float) -> Transform:
    """Shares of a range: of its logarithm, or of itself where it begins at 0."""
    if low > 0.0:
        ratio = np.log(high / low)
        return Transform(
            value=lambda x: low * (high / low) ** x,
            inverse=lambda y: np.log(y / low) / ratio,
            slope=lambda x: ratio * low * (high / low) ** x,
        )
    return Transform(
        value=lambda x: low + x * (high - low),
        inverse=lambda y: (y - low) / (high - low),
        slope=lambda x: np.full_like(x, high - low),
    )


@dataclass(frozen=True)
class ParameterGroup:
    """Entries of one figure: k of them, which are 1 for a figure that all joints share or of joints in step.

    Attributes:
        name: Name of the group.
        figure: Field of `DriveParameters`, which is also its key in the `drives` section of a robot file.
        transform: How an entry makes the figure over its unit.
        unit: Unit of each value of the figure, shape () or (joints,).
        joints: Which joints; None for a figure that all joints share.
        start: Entries to start from, shape (k,).
        scale: Change of an entry that matters, or that is likely where there is a prior, shape (k,).
        lower: Lower bounds, shape (k,).
        upper: Upper bounds, shape (k,).
    """

    name: str
    figure: str
    transform: Transform
    unit: Array
    joints: tuple[int, ...] | None
    start: Array
    scale: Array
    lower: Array
    upper: Array

    @property
    def size(self) -> int:
        """Number k of entries."""
        return len(self.start)


def group(
    drives: DriveParameters,
    figure: str,
    transform: Transform,
    scale: ArrayLike,
    *,
    unit: ArrayLike | None = None,
    bounds: tuple[float, float] = (-np.inf, np.inf),
) -> ParameterGroup:
    """One entry for each value of a figure, starting from that of given drives.

    Args:
        drives: Drives to start from.
        figure: Field of `DriveParameters`.
        transform: How an entry makes the figure over its unit.
        scale: Change of an entry that matters or is likely, one number or shape (k,).
        unit: Unit of the figure; 1 if not given.
        bounds: Bounds of every entry.
    """
    value = np.asarray(getattr(drives, figure), dtype=float)
    unit = np.broadcast_to(np.asarray(1.0 if unit is None else unit, dtype=float), value.shape)
    # A figure whose unit is 0 is 0 whatever the entry is.
    start = np.atleast_1d(transform.inverse(np.divide(value, unit, out=np.ones_like(value), where=unit != 0.0)))
    return ParameterGroup(
        name=figure,
        figure=figure,
        transform=transform,
        unit=unit,
        joints=tuple(range(value.size)) if value.ndim else None,
        start=start,
        scale=np.broadcast_to(np.asarray(scale, dtype=float), start.shape),
        lower=np.full(start.shape, bounds[0]),
        upper=np.full(start.shape, bounds[1]),
    )


@dataclass(frozen=True)
class Prior:
    """Gaussian belief about a vector of P entries.

    Attributes:
        mean: Shape (P,).
        covariance: Shape (P, P).
    """

    mean: Array
    covariance: Array


class ParameterVector:
    """Order, start, scale and bounds of P entries, and what drives they make.

    Args:
        nominal: Drives that figures outside the vector are taken from.
        groups: Groups in the order of the vector.
        inertial: Number of inertial coordinates behind them.
    """

    def __init__(self, nominal: DriveParameters, groups: tuple[ParameterGroup, ...], inertial: int = 0) -> None:
        self.nominal, self.groups = nominal, groups
        ends = np.cumsum([0, *(part.size for part in groups), inertial]).tolist()
        names = [*(part.name for part in groups), INERTIAL]
        self._parts = {name: slice(*pair) for name, pair in zip(names, pairwise(ends), strict=True)}
        self.size: int = ends[-1]
        self.start = self._joined("start", 0.0)
        self.scale = self._joined("scale", 1.0)
        self.lower = self._joined("lower", -np.inf)
        self.upper = self._joined("upper", np.inf)

    def _joined(self, attribute: str, inertial: float) -> Array:
        values = [getattr(part, attribute) for part in self.groups]
        return np.concatenate([*values, np.full(self.size - sum(map(len, values)), inertial)])

    def part(self, name: str) -> slice:
        """Where a group is in the vector, or the `INERTIAL` coordinates."""
        return self._parts[name]

    def keys(self, joint_names: tuple[str, ...]) -> list[tuple[str, ...]]:
        """Where each entry's figure is in the `drives` section of a robot file, for groups without tied joints."""
        return [
            (part.figure,) if joint is None else ("joints", joint_names[joint], part.figure)
            for part in self.groups
            for joint in (part.joints or (None,))
        ]

    def values(self, x: Array) -> dict[str, Array]:
        """Figures over their units at a vector of shape (P,), by group, each of shape (k,)."""
        return {part.name: part.transform.value(x[self.part(part.name)]) for part in self.groups}

    def drives_of(self, values: Mapping[str, ArrayLike]) -> DriveParameters:
        """Drives with given figures over their units, by group."""
        changed: dict[str, Array | float] = {}
        for part in self.groups:
            figure = part.unit * np.asarray(values[part.name], dtype=float)
            if part.joints is None:
                changed[part.figure] = float(np.squeeze(figure))
            else:
                known = changed.get(part.figure, getattr(self.nominal, part.figure))
                array = np.array(np.broadcast_to(known, np.shape(self.nominal.gear_ratio)), dtype=float)
                array[list(part.joints)] = figure
                changed[part.figure] = array
        return replace(self.nominal, **changed)  # type: ignore[arg-type]

    def drives(self, x: Array) -> DriveParameters:
        """Drives at a vector of shape (P,)."""
        return self.drives_of(self.values(x))

    def inertial(self, x: Array) -> Array:
        """Inertial coordinates of a vector."""
        return np.asarray(x[self.part(INERTIAL)])

    def prior(self) -> Prior:
        """Independent entries round the start, of the scale as their deviation."""
        return Prior(self.start.copy(), np.diag(self.scale**2))

    def figures(self, x: Array) -> Array:
        """The figures themselves and the inertial coordinates, entry by entry, shape (P,)."""
        values = self.values(x)
        return np.concatenate(
            [*(np.atleast_1d(part.unit * values[part.name]) for part in self.groups), self.inertial(x)]
        )

    def slopes(self, x: Array) -> Array:
        """Derivatives of `figures` after their entries, shape (P,)."""
        slopes = [part.unit * part.transform.slope(x[self.part(part.name)]) for part in self.groups]
        return np.concatenate([*map(np.atleast_1d, slopes), np.ones(len(self.inertial(x)))])

    def chain(self, gradient: Gradient, x: Array) -> Array:
        """Derivatives after the entries at x, shape (..., P), from those after the figures.

        Args:
            gradient: By field of `DriveParameters`, shapes (...) or (..., n), and for inertial coordinates by
                `INERTIAL`; those of figures outside the vector are not used.
            x: The vector, shape (P,).
        """
        columns = []
        for part in self.groups:
            along = gradient[part.figure]
            columns.append(along[..., None] if part.joints is None else along[..., list(part.joints)])
        if INERTIAL in gradient:
            columns.append(gradient[INERTIAL])
        return np.concatenate(columns, axis=-1) * self.slopes(x)
