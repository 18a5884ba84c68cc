"""Predictors of the thesis (chapter 5) and their training."""
