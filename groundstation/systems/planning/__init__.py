"""Plans of a session's control and ground points, and of a landing by ranges."""
