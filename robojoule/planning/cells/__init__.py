"""Plans of cells: several robots, hand-overs, shared space, power modes."""
