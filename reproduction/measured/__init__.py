"""Motions measured on a machine: collected from its logs, and the predictor that they give."""
