"""Random operation trees (thesis chapter 4)."""
