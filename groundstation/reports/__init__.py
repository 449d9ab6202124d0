"""Pages and fleet tables made from saved results.

Nothing is computed here: every number shown exists in results.
"""
