"""Posterior of the error of a heading on taxi, against the track of GNSS.

The modules hold the noise, its priors, draws and intervals.
"""
