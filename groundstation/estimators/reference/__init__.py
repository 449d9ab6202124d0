"""Comparison with a reference: errors of recorded and estimated data against their sigmas."""
