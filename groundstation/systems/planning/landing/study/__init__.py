"""Studies of the planning system."""
