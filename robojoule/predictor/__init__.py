"""Predictors of an energy profile's parameters: saving, optimal duration, penalty (thesis 5.2).

Estimators are made and fitted with scikit-learn (`make_estimator`, `fit`), turned into plain arrays (`portable`),
written (`export`) and read (`load`) again; a loaded predictor needs numpy only.
"""

from robojoule.predictor.archive import export, load, portable
from robojoule.predictor.estimators import MODELS, fit, make_estimator
from robojoule.predictor.portable import Predictor
from robojoule.predictor.profile_parameters import TARGETS, bounded, input_names, steepness
from robojoule.predictor.tables import columns, read_table

__all__ = [
    "MODELS",
    "TARGETS",
    "Predictor",
    "bounded",
    "columns",
    "export",
    "fit",
    "input_names",
    "load",
    "make_estimator",
    "portable",
    "read_table",
    "steepness",
]
