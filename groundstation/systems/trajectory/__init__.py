"""Best trajectory of a log: raw inertial data and GNSS, smoothed, with sigmas that hold."""
