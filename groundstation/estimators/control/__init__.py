"""Plans of a session: motion of aircraft and places of ground points for a given accuracy."""
