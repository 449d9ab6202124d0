"""Studies of the heading system."""
