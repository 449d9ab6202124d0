"""Several flights: a folder, a cluster, a session of aircraft, and what they say together."""
