"""Latency between sensors, from the motion that they all show."""
