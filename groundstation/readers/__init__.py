"""Readers: one module per log format, found by content; each yields records.

Nothing reads a file whole.
"""
