"""Studies of the magnetic system."""
