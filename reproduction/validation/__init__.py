"""Validation of the physics against measurements of real machines."""
