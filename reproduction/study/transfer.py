"""What other robots teach about a new one: an empirical Bayes prior over the unknowns.

Each robot's fit gives a likelihood of its unknowns, x_r ~ N(b_r, L_r^-1). Scaling laws err by the same kinds of figures
on every arm (gear friction that no entry gives, friction curves that are not straight lines), so the unknowns of one
group (Coulomb friction of all joints of all robots, say) share a mean and a spread, found by expectation maximisation:

    C_r = (L_r + S^-1)^-1 ,  x_r = C_r (L_r b_r + S^-1 m) ,  m_g = mean of x over the group ,
    s_g^2 = mean of (x - m_g)^2 + diag C over the group .

Inertial coordinates keep their mean 0 and variance 1: they mean something else on each robot.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.parameters import ParameterVector, Prior
from robojoule.calibration.run_fit import Calibration
from robojoule.calibration.run_model import PRIOR_SPREAD

_ITERATIONS = 40
_LEAST_SPREAD = 0.02
_PSEUDO_ROBOTS = 2.0  # weight of the expected spread beside what the robots show


def transferred_prior(vector: ParameterVector, others: Sequence[tuple[ParameterVector, Calibration]]) -> Prior:
    """Prior of a new robot.

    Args:
        vector: Unknowns of the new robot.
        others: Unknowns and fits of other robots, fitted with the prior of their entries; none: that prior.
    """
    if not others:
        return vector.prior()
    likelihoods = []
    for known, calibration in others:
        before, after = known.prior(), np.linalg.inv(calibration.covariance)
        precision = np.linalg.inv(before.covariance)
        likelihoods.append((known, after - precision, after @ calibration.x - precision @ before.mean))
    mean = dict.fromkeys(PRIOR_SPREAD, 0.0)
    spread = dict(PRIOR_SPREAD)
    for _ in range(_ITERATIONS):
        values: dict[str, list[Array]] = {group: [] for group in PRIOR_SPREAD}
        variances: dict[str, list[Array]] = {group: [] for group in PRIOR_SPREAD}
        for known, precision, weighted in likelihoods:
            prior = _prior(known, mean, spread)
            inverse = np.linalg.inv(prior.covariance)
            covariance = np.linalg.inv(precision + inverse)
            x = covariance @ (weighted + inverse @ prior.mean)
            for group in PRIOR_SPREAD:
                values[group].append(x[known.part(group)])
                variances[group].append(np.diag(covariance)[known.part(group)])
        for group in PRIOR_SPREAD:
            x, variance = np.concatenate(values[group]), np.concatenate(variances[group])
            mean[group] = float(x.mean())
            expected = _PSEUDO_ROBOTS * PRIOR_SPREAD[group] ** 2
            seen = float(((x - mean[group]) ** 2 + variance).mean()) * len(others)
            spread[group] = max(float(np.sqrt((expected + seen) / (_PSEUDO_ROBOTS + len(others)))), _LEAST_SPREAD)
    return _prior(vector, mean, spread)


def _prior(vector: ParameterVector, mean: dict[str, float], spread: dict[str, float]) -> Prior:
    center, deviation = np.zeros(vector.size), np.ones(vector.size)
    for group, value in mean.items():
        center[vector.part(group)] = value
        deviation[vector.part(group)] = spread[group]
    return Prior(center, np.diag(deviation**2))
