"""Health of an autopilot in flight: filter, GNSS, vibration, magnetometer, power, links, control."""
