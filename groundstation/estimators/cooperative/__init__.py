"""Navigation between aircraft: centralised and decentralised filters on one input, geometry, bounds, consistency."""
