"""How an INS sits in its aircraft and how the aircraft crabs: learned from its earlier flights."""
