"""Claims of the thesis held against our results."""
