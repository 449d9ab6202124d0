"""Posterior of the error of a heading on taxi, against the track of GNSS: noise, its priors, draws, intervals."""
