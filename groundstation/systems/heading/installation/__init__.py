"""Installation of an INS in its aircraft and sideslip, learned from its earlier flights."""
