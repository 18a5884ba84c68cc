"""Figures, merged tables and metrics, and the HTML report of the pipeline. Matplotlib is imported where it is used."""
