"""Magnetic deviation: in flight, on ground runs, as a steer card, and applied to other flights."""
