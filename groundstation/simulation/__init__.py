"""Truth flights and sensor models: seeded, quantised, written as flat CSV.

Every recorder can export that CSV.
"""
