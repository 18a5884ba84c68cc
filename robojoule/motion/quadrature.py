"""Integrals over a run, exact for smooth integrands and accurate across the kink of a positive part.

Within a phase of constant jerk every power is a smooth function of time, so Gauss-Lobatto quadrature converges
spectrally. Its nodes include both ends of a phase, where powers have their peaks and which neighbours share. The DC bus
brings one kink: only its positive part is drawn from the mains. With F the integral since the start of the run,

    int max(P, 0) = [P > 0 at the end] F(end) - sum of F where P turns positive + sum of F where it turns negative .

At the nodes F follows from the polynomial of the phase, and up to a change of sign between two nodes from the cubic
that has the values and slopes of that polynomial there. Integrals of other values over the times at which P > 0 follow
likewise, exactly up to cubics.

Sums run over the nodes of one run at a time, so that its figures do not depend on the runs beside it.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre

from robojoule.arrays import Array, Index
from robojoule.motion.time_laws import PHASES, PathLaw

_NEWTON_STEPS = 6


@lru_cache(maxsize=32)
def lobatto(nodes: int) -> tuple[Array, Array, Array]:
    """Gauss-Lobatto quadrature on the unit interval.

    Args:
        nodes: Number of nodes N, at least 3.

    Returns:
        Nodes from 0 to 1, shape (N,); integrals from 0 to each node of the polynomials that are 1 at one node and 0 at
        the others, shape (nodes N, polynomials N), the last row being the weights; their slopes at the nodes, likewise.
    """
    order = np.arange(nodes)
    last = np.eye(nodes)[-1]  # Legendre polynomial of degree N - 1
    x = np.concatenate([[-1.0], np.sort(np.real(legendre.legroots(legendre.legder(last)))), [1.0]])
    weights = 2.0 / (nodes * (nodes - 1) * legendre.legval(x, last) ** 2)
    # Discrete Legendre transform: coefficients of the interpolating polynomial from values at the nodes.
    norms = np.where(order < nodes - 1, order + 0.5, (nodes - 1) / 2.0)
    to_coefficients = (legendre.legvander(x, nodes - 1) * weights[:, None] * norms).T
    integrals = np.stack([legendre.legval(x, legendre.legint(row, lbnd=-1)) for row in np.eye(nodes)], axis=1)
    slopes = np.stack([legendre.legval(x, legendre.legder(row)) for row in np.eye(nodes)], axis=1)
    return (x + 1.0) / 2.0, np.asarray(integrals @ to_coefficients) / 2.0, np.asarray(slopes @ to_coefficients) * 2.0


class RunQuadrature:
    """Quadrature over the seven phases of a run; Q nodes, those between two phases shared.

    Args:
        jerk: Nodes of each of the four phases of jerk.
        plateau: Nodes of both phases of constant acceleration.
        cruise: Nodes of the phase of constant velocity.
    """

    def __init__(self, jerk: int, plateau: int, cruise: int) -> None:
        rules = [lobatto(n) for n in (jerk, plateau, jerk, cruise, jerk, plateau, jerk)]
        starts = np.cumsum([0] + [len(nodes) - 1 for nodes, _, _ in rules])
        self.count = int(starts[-1]) + 1
        self._phase = np.repeat(np.arange(PHASES), np.diff(starts))  # of the intervals between nodes
        self._weights = np.zeros((self.count, PHASES))
        self._powers = np.zeros((PHASES, 4, self.count))  # of the time since the start of the phase, per its length
        # Of each interval between two nodes, in units of its phase: length, and from values at all nodes the integral
        # since the start of the phase and the slopes at both ends.
        self._width = np.concatenate([np.diff(nodes) for nodes, _, _ in rules])
        self._inside = np.zeros((self.count - 1, 3, self.count))
        for phase, (nodes, integrals, slopes) in enumerate(rules):
            intervals, own = slice(starts[phase], starts[phase + 1]), slice(starts[phase], starts[phase + 1] + 1)
            self._weights[own, phase] = integrals[-1]
            evaluated = len(nodes) - (phase < PHASES - 1)  # a shared node is evaluated as the start of the later phase
            self._powers[phase, :, starts[phase] : starts[phase] + evaluated] = (
                nodes[:evaluated] ** np.arange(4)[:, None]
            )
            for row, table in enumerate((integrals[:-1], slopes[:-1], slopes[1:])):
                self._inside[intervals, row, own] = table

    def states(self, law: PathLaw) -> tuple[Array, Array, Array]:
        """Path position [-], velocity [1/s] and acceleration [1/s2] at the nodes, arrays (..., 7) -> (..., Q)."""
        t, p, v, a, j = law.duration_s, law.position, law.velocity, law.acceleration, law.jerk
        return (
            self._polynomials(p, t * v, t**2 * a / 2.0, t**3 * j / 6.0),
            self._polynomials(v, t * a, t**2 * j / 2.0),
            self._polynomials(a, t * j),
        )

    def _polynomials(self, *coefficients: Array) -> Array:
        terms = len(coefficients)
        stacked = np.stack(coefficients, axis=-1)
        return np.asarray(stacked.reshape(*stacked.shape[:-2], -1) @ self._powers[:, :terms].reshape(-1, self.count))

    def weights(self, law: PathLaw) -> Array:
        """Weights of the nodes in integrals over the run, arrays (..., 7) -> (..., Q). [s]"""
        return np.asarray(law.duration_s @ self._weights.T)

    def positive_part(self, values: Array, law: PathLaw) -> Array:
        """Integral over each run of max(values, 0), shapes (..., Q) -> (...)."""
        flat = values.reshape(-1, self.count)
        lengths = law.duration_s.reshape(-1, PHASES)
        phases = (values @ self._weights).reshape(-1, PHASES) * lengths
        since_start = np.cumsum(phases, axis=1)
        runs, intervals, before, cubic, root = self._sign_changes(flat)
        phase, width = self._phase[intervals], self._width[intervals]
        inside = before + width * _cubic_integral(root, *cubic)
        until = since_start[runs, phase] - phases[runs, phase] + lengths[runs, phase] * inside
        result = np.where(flat[:, -1] < 0.0, 0.0, since_start[:, -1])
        result += np.bincount(runs, np.where(cubic[0] < 0.0, -until, until), minlength=len(flat))
        return np.asarray(result.reshape(values.shape[:-1]))

    def positive_weights(self, values: Array, law: PathLaw) -> Array:
        """Weights of the nodes in integrals over the times at which values are positive, shapes (..., Q) -> (..., Q).

        They are the derivatives of `positive_part` after the values, which vanish on the edges of those times. [s]
        """
        flat = values.reshape(-1, self.count)
        lengths = law.duration_s.reshape(-1, PHASES)
        runs, intervals, _, cubic, root = self._sign_changes(flat)
        phase, width, changes = self._phase[intervals], self._width[intervals], np.arange(len(runs))
        left, right, rise, fall = width * _cubic_integral(root, *np.eye(4)[..., None])
        shares = np.stack([np.ones_like(width), width * rise, width * fall], axis=1)
        until = np.einsum("rt,rtq->rq", shares, self._inside[intervals])  # in units of the phase
        until[changes, intervals] += left
        until[changes, intervals + 1] += right
        until *= lengths[runs, phase, None]
        earlier = np.where(np.arange(PHASES) < phase[:, None], lengths[runs], 0.0)
        until += np.einsum("rp,qp->rq", earlier, self._weights)
        result = np.where(flat[:, -1:] < 0.0, 0.0, self.weights(law).reshape(flat.shape))
        np.add.at(result, runs, np.where(cubic[0] < 0.0, -1.0, 1.0)[:, None] * until)
        return np.asarray(result.reshape(values.shape))

    def _sign_changes(self, flat: Array) -> tuple[Index, Index, Array, tuple[Array, Array, Array, Array], Array]:
        """Where values (R, Q) change their sign between two nodes.

        Returns:
            Runs and intervals of the changes; there, in units of the phase, the integral from its start to the
            interval; the cubic within the interval by values and slopes at both ends, and its root, for the unit
            interval.
        """
        negative = flat < 0.0
        runs, intervals = np.divmod(np.flatnonzero(negative[:, 1:] != negative[:, :-1]), self.count - 1)
        width = self._width[intervals]
        before, rise, fall = np.einsum("rtq,rq->tr", self._inside[intervals], flat[runs])
        cubic = flat[runs, intervals], flat[runs, intervals + 1], rise * width, fall * width
        return runs, intervals, before, cubic, _cubic_root(*cubic)


def _cubic_root(left: Array, right: Array, rise: Array, fall: Array) -> Array:
    """Roots of cubics on the unit interval.

    Args:
        left: Values at 0.
        right: Values at 1, of the other sign.
        rise: Slopes at 0.
        fall: Slopes at 1.
    """
    second, third = 3.0 * (right - left) - 2.0 * rise - fall, 2.0 * (left - right) + rise + fall
    u, low, high = left / (left - right), np.zeros_like(left), np.ones_like(left)
    for _ in range(_NEWTON_STEPS):
        value, slope = left + u * (rise + u * (second + u * third)), rise + u * (2.0 * second + 3.0 * u * third)
        before = (value < 0.0) == (left < 0.0)
        low, high = np.where(before, u, low), np.where(before, high, u)
        step = np.divide(value, slope, out=np.full_like(u, np.inf), where=slope != 0.0)
        # Near an extremum a Newton step may lead out of the bracket, which is then halved.
        u = np.where((u - step >= low) & (u - step <= high), u - step, (low + high) / 2.0)
    return u


def _cubic_integral(u: Array, left: Array, right: Array, rise: Array, fall: Array) -> Array:
    """Integral from 0 to u of cubics, given as for `_cubic_root`."""
    second, third = 3.0 * (right - left) - 2.0 * rise - fall, 2.0 * (left - right) + rise + fall
    return np.asarray(u * (left + u * (rise / 2.0 + u * (second / 3.0 + u * third / 4.0))))


@lru_cache(maxsize=32)
def run_quadrature(path_nodes: int) -> RunQuadrature:
    """Quadrature for torques of a number of path nodes: the cruise may cover the whole path, other phases half."""
    return RunQuadrature(max(5, path_nodes // 4 + 1), max(7, path_nodes * 2 // 5 + 1), path_nodes * 4 // 5 + 1)
