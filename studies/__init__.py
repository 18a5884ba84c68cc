"""The larger comparisons: one module a stage of `studies/dvc.yaml`."""
