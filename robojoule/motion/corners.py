"""The geometry of blended motions: straight legs in joint space, joined by smooth corners at the points between.

A chain goes from stop to stop through points with zones. Its path coordinate x has the unit of time: a leg from q_i to
q_i+1 takes L_i = max_j |dq_ij| / v_max,j of it, what it lasts at full speed, so that path velocity dx/dt = 1 is full
speed all along. In a corner of half length h the slope turns from that of one leg to that of the next one,

    dq/dx = A (1 - f(u)) + B f(u) ,    f'(u) = 5/4 (1 - (2 u - 1)^4) ,    u from 0 to 1 over 2 h ,

so the path leaves one leg h before the point and meets the next one h behind it, slope and curvature are continuous,
no joint exceeding its speed on the faster leg.

h is the largest length for which all of the corner keeps within the zone:

- a radius is a distance of the tool from the point, which legs and corner keep;
- a share is one of the legs beside the point, for controllers that give no radius. It is an assumption;
- in any case a corner takes two fifths of a leg at most: neighbours do not overlap, and a fifth is left to change
  speed, without which the slowest corner would be the speed of all;
- it takes the same of both legs: the tighter side counts for both.

Points that the path reaches without moving (less than a microradian from their neighbour) make no corner.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial

from robojoule.arrays import Array, Index
from robojoule.motion.path import CurvedPath
from robojoule.robots.robot import Robot

LARGEST_SHARE = 0.4  # of a leg, that a corner may take
SAME_POINT_RAD = 1e-6  # points nearer than this are one
_SAMPLES = 64  # of half a leg and of a corner, at which the tool's distance is looked at
_BISECTIONS = 16  # within a step between samples
_SHRINKINGS = 200
_HALVINGS = 52  # of a corner, to where a joint turns back
_LEAST_SHARE = 1e-6  # of the shorter leg that a corner takes, however narrow its zone: rounding has no corners
# Coefficients over u of f and of its integral: accelerations that are nearly level take the least torque for a turn.
_TURN = np.array([0.0, 0.0, 5.0, -10.0, 10.0, -4.0])
_TURNED = np.array([0.0, 0.0, 0.0, 5.0 / 3.0, -2.5, 2.0, -2.0 / 3.0])
_NARROWEST = 1e-9  # share of a corner that a piece of it takes at least


@dataclass(frozen=True, eq=False)
class Chain:
    """Points from stop to stop, K legs, for n joints.

    Attributes:
        points_rad: Configurations, shape (K + 1, n). [rad]
        radius_m: Radius of the zones of the points between, shape (K - 1,); infinite where there is none. [m]
        path_share: Share of the legs beside each of these points that its corner may take, shape (K - 1,). [-]
    """

    points_rad: Array
    radius_m: Array
    path_share: Array

    @classmethod
    def straight(cls, start_rad: Array, end_rad: Array) -> Chain:
        """A motion of one leg. [rad]"""
        return cls(np.stack([start_rad, end_rad]), np.zeros(0), np.zeros(0))

    def distinct(self) -> tuple[Chain, Index]:
        """The chain without points that are where their neighbour is, and the leg of this one that each leg is of."""
        points, radii, shares = list(self.points_rad), list(self.radius_m), list(self.path_share)
        legs = list(range(len(points) - 1))
        k = 0
        while k < len(legs) and len(legs) > 1:
            if np.abs(points[k + 1] - points[k]).max() > SAME_POINT_RAD:
                k += 1
                continue
            # The point between is dropped: the one before the leg, or its end where the leg starts at the stop.
            between = min(max(k, 1), len(legs) - 1)
            if 1 <= k < len(legs) - 1:  # both ends have zones: the point that stays takes the narrower ones
                radii[k] = min(radii[k - 1], radii[k])
                shares[k] = min(shares[k - 1], shares[k])
            del points[between], radii[between - 1], shares[between - 1], legs[k]
        return Chain(np.array(points), np.array(radii), np.array(shares)), np.array(legs, dtype=np.intp)


@dataclass(frozen=True, eq=False)
class Corners:
    """Legs of many chains, one after the other, and the corners between them.

    Attributes:
        start_rad: Start of each of the legs, shape (L, n). [rad]
        end_rad: Its end, shape (L, n). [rad]
        chain: Chain of each leg, shape (L,).
        leg: Leg of the chain as given that each leg is of, counted through all chains, shape (L,).
        length_s: What each leg takes at full speed, shape (L,). [s]
        before: Leg before each of the corners, shape (C,); the one after it is the next one.
        half_s: Half length of each corner, shape (C,). [s]
        pieces: Smooth pieces of the corners on which no joint turns back, P of them.
        corner: Corner of each piece, shape (P,).
        share: Share of the corner that each piece takes, shape (P,). [-]
    """

    start_rad: Array
    end_rad: Array
    chain: Index
    leg: Index
    length_s: Array
    before: Index
    half_s: Array
    pieces: CurvedPath
    corner: Index
    share: Array

    @classmethod
    def of(cls, robot: Robot, chains: Sequence[Chain], half_s: Array | None = None) -> Corners:
        """Corners of chains.

        Args:
            robot: The robot whose tool radii are of and whose full speed lengths are of.
            chains: The chains.
            half_s: Half lengths of the corners, shape (C,), where they are known already. [s]
        """
        kept = [chain.distinct() for chain in chains]
        counts = [len(legs) for _, legs in kept]
        first = np.cumsum([0] + [len(chain.points_rad) - 1 for chain in chains])
        start = np.concatenate([chain.points_rad[:-1] for chain, _ in kept])
        end = np.concatenate([chain.points_rad[1:] for chain, _ in kept])
        length = np.max(np.abs(end - start) / robot.velocity_rad_s, axis=1)
        ends = np.cumsum(counts)
        before = np.setdiff1d(np.arange(len(start)), ends - 1)
        radius = np.concatenate([chain.radius_m for chain, _ in kept])
        share = np.concatenate([chain.path_share for chain, _ in kept])
        half = half_s
        if half is None:
            half = _half_lengths(robot, start, end, length, before, radius, np.minimum(share, LARGEST_SHARE))
        pieces, corner, widths = _pieces(_polynomials(start, end, length, before, half))
        return cls(
            start_rad=start,
            end_rad=end,
            chain=np.repeat(np.arange(len(chains)), counts),
            leg=np.concatenate([legs + at for (_, legs), at in zip(kept, first, strict=False)]).astype(np.intp),
            length_s=length,
            before=before,
            half_s=half,
            pieces=pieces,
            corner=corner,
            share=widths,
        )

    def half_lengths_s(self, chains: Sequence[int]) -> Array:
        """Half lengths of the corners of some chains, one after the other. [s]"""
        of_corner = self.chain[self.before]
        return np.concatenate([self.half_s[of_corner == chain] for chain in chains])

    @property
    def after(self) -> Index:
        """Leg after each corner, shape (C,)."""
        return self.before + 1

    @property
    def cuts_s(self) -> Array:
        """What corners take of each leg at its start and end, shape (L, 2). [s]"""
        cuts = np.zeros((len(self.length_s), 2))
        cuts[self.after, 0], cuts[self.before, 1] = self.half_s, self.half_s
        return cuts

    def points_rad(self, chain: int, step_rad: float) -> Array:
        """Configurations along a chain, evenly spaced on each part. [rad]

        Args:
            chain: Which chain.
            step_rad: No joint moves further between two of them. [rad]

        Returns:
            Shape (N, n). [rad]
        """
        parts, cuts = [], self.cuts_s
        for leg in np.flatnonzero(self.chain == chain).tolist():
            delta = self.end_rad[leg] - self.start_rad[leg]
            length = max(float(self.length_s[leg]), 1e-300)
            a, b = cuts[leg, 0] / length, 1.0 - cuts[leg, 1] / length
            steps = max(1, int(np.ceil((b - a) * np.abs(delta).max() / step_rad - 1e-9)))
            parts.append(self.start_rad[leg] + np.linspace(a, b, steps + 1)[:, None] * delta)
            for at in np.flatnonzero(self.before == leg).tolist():
                for piece in np.flatnonzero(self.corner == at).tolist():
                    steepest = float(self.pieces.of(slice(piece, piece + 1)).steepest_rad.max())
                    s = np.linspace(0.0, 1.0, max(1, int(np.ceil(steepest / step_rad))) + 1)
                    parts.append(self.pieces.positions_rad(slice(piece, piece + 1), s)[:, 0].T)
        return np.concatenate(parts)


def _half_lengths(
    robot: Robot, start: Array, end: Array, length: Array, before: Index, radius_m: Array, share: Array
) -> Array:
    """Largest half lengths of corners within their zones, shape (C,). [s]"""
    shorter = np.minimum(length[before], length[before + 1])
    half = share * shorter
    bound = np.flatnonzero(np.isfinite(radius_m))
    if bound.size == 0:
        return np.maximum(half, _LEAST_SHARE * shorter)
    via, at_via = end[before[bound]], robot.tool_placements(end[before[bound]])[0]
    for legs, sign in ((before[bound], -1.0), (before[bound] + 1, 1.0)):
        slope = sign * (end[legs] - start[legs]) / length[legs, None]
        half[bound] = np.minimum(half[bound], _within(robot, via, at_via, slope, half[bound], radius_m[bound]))
    for _ in range(_SHRINKINGS):
        curves = _polynomials(start, end, length, before[bound], half[bound])
        at = CurvedPath(curves).positions_rad(slice(None), np.linspace(0.0, 1.0, _SAMPLES + 1))
        away = _distances(robot, at.transpose(1, 2, 0), at_via).max(axis=1)
        beyond = away > radius_m[bound]
        if not beyond.any():
            break
        half[bound] = np.where(beyond, half[bound] * np.clip(radius_m[bound] / away, 0.5, 0.99), half[bound])
    return np.maximum(half, _LEAST_SHARE * shorter)


def _within(robot: Robot, via: Array, at_via: Array, slope: Array, most: Array, radius_m: Array) -> Array:
    """How far along slopes (C, n), from points (C, n) on, the tool keeps within radii of the points; `most` at most.

    The tool is at (C, 3) [m] there.
    """
    shares = np.arange(1, _SAMPLES + 1) / _SAMPLES
    at = via[:, None] + (most[:, None] * shares)[..., None] * slope[:, None]
    beyond = _distances(robot, at, at_via) > radius_m[:, None]
    first = np.where(beyond.any(axis=1), beyond.argmax(axis=1), _SAMPLES)
    high = most * np.minimum(first + 1, _SAMPLES) / _SAMPLES
    low = most * first / _SAMPLES
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2.0
        inside = _distances(robot, (via + middle[:, None] * slope)[:, None], at_via)[:, 0] <= radius_m
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return low


def _distances(robot: Robot, q: Array, at_via: Array) -> Array:
    """Distances of the tool at configurations (C, K, n) [rad] from places (C, 3) [m], shape (C, K). [m]"""
    at = robot.tool_placements(q.reshape(-1, q.shape[2]))[0].reshape(*q.shape[:2], 3)
    return np.asarray(np.linalg.norm(at - at_via[:, None], axis=2))


def _polynomials(start: Array, end: Array, length: Array, before: Index, half: Array) -> Array:
    """Coefficients over u of corners of half lengths (C,), shape (C, n, 7). [rad]"""
    one, other = (
        (end[legs] - start[legs]) / length[legs, None] * half[:, None] for legs in (before, before + 1)
    )  # what each joint turns on the legs over half the corner
    curves: Array = 2.0 * (other - one)[..., None] * _TURNED
    curves[..., 0] += end[before] - one
    curves[..., 1] += 2.0 * one
    return curves


def _pieces(curves: Array) -> tuple[CurvedPath, Index, Array]:
    """Corners (C, n, 7) cut where a joint turns back: pieces, the corner of each and the share of it that it takes."""
    before, turn = curves[:, :, 1] / 2.0, curves[:, :, 3] / (2.0 * _TURNED[3])
    turns_back = before * (before + turn) < 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.clip(np.where(turns_back, -before / turn, 0.5), 0.0, 1.0)
    low, high = np.zeros_like(share), np.ones_like(share)  # where f(u), which rises, is that share
    for _ in range(_HALVINGS):
        at = (low + high) / 2.0
        below = polynomial.polyval(at, _TURN) < share
        low, high = np.where(below, at, low), np.where(below, high, at)
    parts, corner, widths = [], [], []
    for c, row in enumerate(curves):
        cuts = np.unique(np.concatenate([[0.0], at[c][turns_back[c]], [1.0]]))
        cuts = np.append(cuts[:-1][np.diff(cuts) > _NARROWEST], 1.0)
        cuts[0] = 0.0
        for low, high in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
            parts.append(row @ _shifted(low, high - low))
            corner.append(c)
            widths.append(high - low)
    shape = (len(parts), *curves.shape[1:])
    return CurvedPath(np.array(parts).reshape(shape)), np.array(corner, dtype=np.intp), np.array(widths)


def _shifted(low: float, width: float) -> Array:
    """Table that turns coefficients over u into those over s, u = low + width s, shape (7, 7)."""
    table, power = np.zeros((len(_TURNED), len(_TURNED))), np.array([1.0])
    for k in range(len(_TURNED)):
        table[k, : k + 1] = power
        power = np.convolve(power, [low, width])
    return table
