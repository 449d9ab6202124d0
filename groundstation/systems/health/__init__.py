"""Health of an autopilot in flight.

Filter, GNSS, vibration, magnetometer, power, links, control.
"""
