"""Filters of a session for vehicles of any kind: what could be known on board.

numpy alone, nothing is compiled: a filter's step handles a few small matrices, and what is large (places of antennas,
transitions) is worked out for many times at once and kept for all filters of a session. ``tests`` hold them against the
same filters as their books write them.
"""
