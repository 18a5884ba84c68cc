"""Studies of the predictors on plants that differ from their nominal catalog entry."""
