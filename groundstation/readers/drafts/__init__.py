"""Help with profiles: a draft for a table, a check against one, the nearest known."""
