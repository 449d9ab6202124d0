"""Quantiles of the normal distribution that the package states its intervals by."""

NORMAL_95 = 1.96  # an error of one axis stays within so many sigma in 95 % of cases
