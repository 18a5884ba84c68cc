"""Cells of robots with their programs: the cell that they make up, its plan written back, all robots simulated."""
