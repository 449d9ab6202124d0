"""Verbs other than ``run``."""
