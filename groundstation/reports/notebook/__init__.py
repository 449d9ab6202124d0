"""Plots of a flight as matplotlib figures, for notebooks.

The only package that imports matplotlib.
"""
