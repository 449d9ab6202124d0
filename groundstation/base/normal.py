"""Quantiles of the normal distribution that the package uses for its intervals."""

NORMAL_95 = 1.96  # an error of one axis stays within so many sigma in 95 % of cases
