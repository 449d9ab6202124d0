"""Navigation between aircraft: centralised and decentralised filters on one input.

Geometry, bounds and consistency are judged beside them.
"""
