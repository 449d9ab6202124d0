"""Studies of the cooperative system."""
