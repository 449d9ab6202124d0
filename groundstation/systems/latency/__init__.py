"""Latency between sensors that show the same motion."""
