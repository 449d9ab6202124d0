"""Studies of the inertial system."""
