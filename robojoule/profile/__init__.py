"""Energy profiles, the electrical energy E(d) of a motion over its duration d, and where they come from."""
