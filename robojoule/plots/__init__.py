"""Drawings of single results; matplotlib is imported where something is drawn."""
