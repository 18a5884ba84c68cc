"""Identification: a robot's drive parameters from measured motions and mains power."""

from robojoule.identification.identify import Identification, Parameter, Score, identify
from robojoule.identification.log import MeasuredLog, read_log

__all__ = ["Identification", "MeasuredLog", "Parameter", "Score", "identify", "read_log"]
