"""Navigation between aircraft by ranges to each other and to points on the ground."""
