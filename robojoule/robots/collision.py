"""Collisions of a robot with itself, its base column and the floor: capsules round the links.

A capsule is a segment with a radius, so every check is a distance between two segments, or between a segment's ends
and the floor, for all configurations at once.

Rules:
- The floor is the plane z = 0 of the base frame.
- Links that share a joint, and a link with what it carries, are exempt: they touch by construction.
- Pairs that touch in every configuration (capsules wider than the short link between them) cannot be judged and are
  exempt too; they are found by sampling the joint limits and are listed in `CollisionModel.exempt`.
- The payload is a solid aluminium sphere of its mass round its centre of mass.
"""

from __future__ import annotations

from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array
from robojoule.robots.robot import PAYLOAD_DENSITY_KG_M3, Robot
from robojoule.robots.robot_file import CapsuleFile, RobotFile

FLOOR = "the floor"
TOOL = "the payload"
PATH_STEP_RAD = float(np.radians(2.0))

# Radius of derived capsules as a share of the arm's reach, at the base and at the last link. The drawings of 6-axis
# arms of 1 to 2 m reach are close to it: the column 7-9 %, the upper arm 5-7 %, the wrist 4 % of the reach.
BASE_RADIUS_SHARE = 0.075
WRIST_RADIUS_SHARE = 0.04
_SHORTEST_CAPSULE_M = 1e-3
_SAMPLES = 256


class CollisionModel:
    """Capsules of a robot and its payload.

    Args:
        robot: Robot; capsules that its file does not give are derived from the kinematics (`derive_capsules`).

    Attributes:
        names: Link of every capsule, length K.
        pairs: Indices of the capsules that are checked against each other, shape (P, 2).
        exempt: Names of the pairs of not adjacent links (or link and floor) that always touch, so are not checked.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.names, self._bodies, self._ends_m, self._radii_m = _capsules(robot)
        candidates = [
            pair for pair in combinations(range(len(self.names)), 2) if abs(np.diff(self._bodies[list(pair)])[0]) > 1
        ]
        self.pairs = np.array(candidates, dtype=np.intp).reshape(-1, 2)
        self._above_floor = np.flatnonzero(self._bodies > 0)
        self.exempt = self._leave_out_what_always_touches()

    def _leave_out_what_always_touches(self) -> tuple[tuple[str, str], ...]:
        rng = np.random.default_rng(0)
        q = rng.uniform(self._robot.lower_rad, self._robot.upper_rad, (_SAMPLES, self._robot.joint_count))
        always = np.all(self.clearances_m(q) <= 0, axis=0)
        exempt = tuple(name for name, out in zip(self.checks, always, strict=True) if out)
        count = len(self.pairs)
        self.pairs = self.pairs[~always[:count]]
        self._above_floor = self._above_floor[~always[count:]]
        return exempt

    @property
    def checks(self) -> tuple[tuple[str, str], ...]:
        """Names of what is checked against what, in the order of `clearances_m`."""
        pairs = [(self.names[first], self.names[second]) for first, second in self.pairs]
        return (*pairs, *((self.names[index], FLOOR) for index in self._above_floor))

    @property
    def radii_m(self) -> Array:
        """Radius of every capsule, shape (K,). [m]"""
        return self._radii_m

    @cached_property
    def levers_m(self) -> Array:
        """How far a capsule's axis can be from each joint that carries it, zero for other joints, shape (K, n). [m]

        It is at most the way from the origin of the joint over those behind it to the end of the capsule.
        """
        mechanism = self._robot.mechanism
        lengths = np.array([float(np.linalg.norm(placement.origin_m)) for placement in mechanism.placements])
        own = np.linalg.norm(self._ends_m, axis=2).max(axis=1)
        levers = np.zeros((len(self.names), mechanism.joint_count))
        for k, body in enumerate(self._bodies.tolist()):
            for joint in range(body):
                levers[k, joint] = lengths[joint + 1 : body].sum() + own[k]
        return levers

    def segments_m(self, q: ArrayLike) -> Array:
        """Ends of every capsule's segment in the base frame.

        Args:
            q: Joint positions, shape (N, n). [rad]

        Returns:
            Shape (K, 2, N, 3). [m]
        """
        q = np.atleast_2d(np.asarray(q, dtype=float))
        rotations, origins = (part[self._bodies] for part in self._robot.mechanism.body_placements(q))
        points = self._ends_m[..., None]  # (K, 2, 3, 1)
        turned = [rotations[:, None, :, j] * points[:, :, j, None] for j in range(3)]  # (K, 2, 3, N) each
        ends = turned[0] + turned[1] + turned[2] + origins[:, None]
        return np.asarray(np.swapaxes(ends, 2, 3))

    def clearances_m(self, q: ArrayLike) -> Array:
        """Distance between the surfaces of what is checked; negative or zero where they touch.

        Args:
            q: Joint positions, shape (N, n). [rad]

        Returns:
            Shape (N, checks), in the order of `checks`. [m]
        """
        segments = self.segments_m(q)
        first, second = segments[self.pairs[:, 0]], segments[self.pairs[:, 1]]
        distances = segment_distances_m(first[:, 0], first[:, 1], second[:, 0], second[:, 1])
        between = distances - self._radii_m[self.pairs].sum(axis=1)[:, None]
        heights = segments[self._above_floor, :, :, 2].min(axis=1) - self._radii_m[self._above_floor, None]
        return np.concatenate([between, heights]).T

    def collides(self, q: ArrayLike) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Whether the robot touches itself, its base or the floor.

        Args:
            q: Joint positions, shape (N, n). [rad]

        Returns:
            Shape (N,).
        """
        return np.asarray(np.any(self.clearances_m(q) <= 0, axis=1))

    def path_collides(self, start_rad: ArrayLike, end_rad: ArrayLike, step_rad: float = PATH_STEP_RAD) -> bool:
        """Whether the robot touches anything on the straight joint-space path, both ends included.

        Args:
            start_rad: Joint positions, shape (n,). [rad]
            end_rad: Joint positions, shape (n,). [rad]
            step_rad: Largest step of any joint between two checked configurations. [rad]
        """
        return bool(np.any(self.collides(path_points_rad(start_rad, end_rad, step_rad))))

    def first_collision(self, q: ArrayLike) -> tuple[str, str] | None:
        """What touches what most deeply in one configuration, shape (n,) [rad]; None if nothing does."""
        clearances = self.clearances_m(q)[0]
        worst = int(np.argmin(clearances))
        return self.checks[worst] if clearances[worst] <= 0 else None


def path_points_rad(start_rad: ArrayLike, end_rad: ArrayLike, step_rad: float = PATH_STEP_RAD) -> Array:
    """Configurations on a straight joint-space path, evenly spaced, both ends included.

    Args:
        start_rad: Joint positions, shape (n,). [rad]
        end_rad: Joint positions, shape (n,). [rad]
        step_rad: No joint moves further between two of them. [rad]

    Returns:
        Shape (N, n). [rad]
    """
    start, end = np.asarray(start_rad, dtype=float), np.asarray(end_rad, dtype=float)
    steps = max(1, int(np.ceil(np.max(np.abs(end - start)) / step_rad - 1e-9)))
    return np.asarray(start + np.linspace(0.0, 1.0, steps + 1)[:, None] * (end - start))


def segment_distances_m(a0: Array, a1: Array, b0: Array, b1: Array) -> Array:
    """Shortest distances between pairs of segments.

    The squared distance is a convex quadratic over the unit square of the two segment parameters: its minimum is the
    stationary point if that lies inside, and otherwise lies on an edge, that is, at an end of one of the segments.
    Segments of zero length and parallel ones need no case of their own.

    Args:
        a0: Starts of the first segments, shape (..., 3). [m]
        a1: Ends of the first segments, shape (..., 3). [m]
        b0: Starts of the second segments, shape (..., 3). [m]
        b1: Ends of the second segments, shape (..., 3). [m]

    Returns:
        Shape (...). [m]
    """
    u, v, w = a1 - a0, b1 - b0, a0 - b0
    uu, vv, uv = _dot(u, u), _dot(v, v), _dot(u, v)
    uw, vw, ww = _dot(u, w), _dot(v, w), _dot(w, w)

    def squared(s: Array | float, t: Array | float) -> Array:
        return np.asarray(s * s * uu + t * t * vv + ww + 2.0 * (s * uw - t * vw - s * t * uv))

    safe_uu, safe_vv = np.where(uu > 0, uu, 1.0), np.where(vv > 0, vv, 1.0)
    best = squared(0.0, np.clip(vw / safe_vv, 0.0, 1.0))
    for s, t in (
        (1.0, np.clip((vw + uv) / safe_vv, 0.0, 1.0)),
        (np.clip(-uw / safe_uu, 0.0, 1.0), 0.0),
        (np.clip((uv - uw) / safe_uu, 0.0, 1.0), 1.0),
    ):
        best = np.minimum(best, squared(s, t))
    determinant = uu * vv - uv * uv
    crossing = determinant > 1e-12 * uu * vv
    scale = np.where(crossing, determinant, 1.0)
    s, t = (uv * vw - vv * uw) / scale, (uu * vw - uv * uw) / scale
    inside = crossing & (s > 0) & (s < 1) & (t > 0) & (t < 1)
    best = np.where(inside, np.minimum(best, squared(s, t)), best)
    return np.asarray(np.sqrt(np.maximum(best, 0.0)))


def derive_capsules(file: RobotFile) -> dict[str, list[CapsuleFile]]:
    """Capsules of a serial arm from its kinematics alone.

    Every moving link gets one capsule from its own joint to the next joint (the last one: to the tool frame), unless
    both are in the same place. The root link gets one from the floor to joint 1; where joint 1 turns about the
    vertical it is drawn up to the height of joint 2, as the column stands there in every configuration. With
    the reach L as the sum of the lengths from joint 2 (of a single joint: from it) to the tool frame, radii fall evenly
    from 7.5 % of L at the root link to 4 % of L at the last link.

    Args:
        file: Robot file; its own capsules are not looked at.

    Returns:
        Capsules per link, in link axes, as in a robot file.
    """
    mechanism, joints = Robot(file).mechanism, file.moving_joints
    placements = [*mechanism.placements, mechanism.tool]
    ends = [placement.origin_m for placement in placements]
    reach_m = float(sum(np.linalg.norm(end) for end in ends[min(2, len(joints)) :]))
    shares = np.linspace(BASE_RADIUS_SHARE, WRIST_RADIUS_SHARE, len(ends))
    vertical = placements[0].rotation @ mechanism.axes[0]
    if len(joints) > 1 and abs(vertical[2]) > 0.999:
        ends[0] = np.array([*ends[0][:2], placements[0].at(ends[1])[2]])
    capsules: dict[str, list[CapsuleFile]] = {}
    for link, end, share in zip([file.root_link, *(joint.child for joint in joints)], ends, shares, strict=True):
        if np.linalg.norm(end) >= _SHORTEST_CAPSULE_M:
            x, y, z = (round(float(value), 4) + 0.0 for value in end)
            radius_m = round(float(share) * reach_m, 3)
            capsules[link] = [CapsuleFile(from_m=(0.0, 0.0, 0.0), to_m=(x, y, z), radius_m=radius_m)]
    return capsules


def _capsules(robot: Robot) -> tuple[tuple[str, ...], np.ndarray[tuple[int], np.dtype[np.intp]], Array, Array]:
    """Names (K), body indices (K), segment ends in body axes (K, 2, 3) and radii (K) of a robot with its payload."""
    names, bodies, ends, radii = [], [], [], []
    for link, capsules in (robot.file.capsules or derive_capsules(robot.file)).items():
        body, placement = robot.mechanism.anchors[link]
        for capsule in capsules:
            names.append(link)
            bodies.append(body)
            ends.append([placement.at(capsule.from_m), placement.at(capsule.to_m)])
            radii.append(capsule.radius_m)
    if robot.payload.mass_kg > 0:
        names.append(TOOL)
        bodies.append(robot.mechanism.tool_body)
        ends.append([robot.mechanism.tool.at(robot.payload.com_m)] * 2)
        radii.append(float((3.0 * robot.payload.mass_kg / (4.0 * np.pi * PAYLOAD_DENSITY_KG_M3)) ** (1.0 / 3.0)))
    return tuple(names), np.array(bodies, dtype=np.intp), np.array(ends, dtype=float).reshape(-1, 2, 3), np.array(radii)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("...i,...i->...", a, b))
