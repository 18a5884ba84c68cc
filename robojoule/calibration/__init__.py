"""Figures of a machine from its own data: measured logs and measured runs."""
