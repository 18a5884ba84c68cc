"""The plan experiment (thesis chapter 6)."""
