"""The record of trainings in MLflow."""
