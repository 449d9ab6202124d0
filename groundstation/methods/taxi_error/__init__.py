"""Posterior of the error of a heading on taxi, against the track of GNSS.

Noise, its priors, draws, intervals.
"""
