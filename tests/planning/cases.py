"""Planning problems on analytic profiles E = a/d + b + c d, for several test modules."""

from dataclasses import dataclass

import numpy as np

from robojoule.planning.costs import VertexCosts
from robojoule.planning.graph import Arc, OptimizationGraph, Vertex
from robojoule.profile.piecewise import PiecewiseLinearProfile


@dataclass(frozen=True)
class Analytic:
    """E(d) = a/d + b + c d on [low, high]."""

    a: float
    b: float
    c: float
    low: float
    high: float

    def energy(self, d):
        return self.a / d + self.b + self.c * d

    def chords(self, count):
        d = np.geomspace(self.low, self.high, count + 1)
        return PiecewiseLinearProfile(d, self.energy(d))


def analytic(count, seed=0):
    rng = np.random.default_rng(seed)
    low = rng.uniform(0.3, 0.9, count)
    return [
        Analytic(rng.uniform(100, 500), rng.uniform(0, 100), rng.uniform(300, 400), d, 4.5 * d) for d in low.tolist()
    ]


def ring(count, robot="r", prefix="v", waits=None):
    """Vertices and edges of one robot's cycle; `waits` are least (prior, post) waits by vertex number."""
    waits = waits or {}
    vertices = tuple(Vertex(f"{prefix}{i}", robot, (), *waits.get(i, (0.0, 0.0))) for i in range(count))
    edges = tuple(Arc(f"{prefix}{i}", f"{prefix}{(i + 1) % count}", int(i == count - 1)) for i in range(count))
    return vertices, edges


def one_robot(count, waits=None):
    vertices, edges = ring(count, waits=waits)
    return OptimizationGraph(vertices, edges)


def costs_of(profiles, idle_w):
    """Costs with the idle power after each vertex; that before it is its predecessor's."""
    return [VertexCosts(p, idle_w[i - 1], idle_w[i]) for i, p in enumerate(profiles)]
