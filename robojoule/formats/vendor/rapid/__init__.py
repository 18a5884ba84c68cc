"""ABB's RAPID programs (.mod, .prg)."""
