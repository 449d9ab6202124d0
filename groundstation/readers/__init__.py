"""Readers: one module per log format, found by content; each yields records and nothing reads a file whole."""
