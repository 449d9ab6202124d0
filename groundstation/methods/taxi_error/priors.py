"""Priors of the parameters of the noise model.

They are log-normal, and broader than every family of simulated runs.
"""

import numpy as np

from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.methods.taxi_error import noise

# Priors: each parameter is log-normal. (median, sigma of the natural logarithm): two sigma either side reach over
# 0.007-0.37 m/s, 0.007-0.12 m/s, 0.36-44 s, 0.05-3 deg, 0.1-1.3 Hz, 0.012-0.99, 0.003-0.2 deg, 0.2-5 times,
# 0.1-11 arcmin, 0.1-40 arcmin, 8-440 s.
PRIOR: dict[str, tuple[float, float]] = {
    "white_mps": (0.05, 1.0),
    "correlated_mps": (0.03, 0.7),
    "correlation_s": (4.0, 1.2),
    "sway_deg": (0.4, 1.0),
    "sway_hz": (0.36, 0.65),
    "sway_damping": (0.15, 1.25),
    "heading_white_deg": (0.025, 1.05),
    "motion_factor": (1.0, 0.8),
    "segment_deg": (1.0 / ARCMIN_PER_DEG, 1.2),
    "wander_deg": (2.0 / ARCMIN_PER_DEG, 1.5),
    "wander_s": (60.0, 1.0),
}
PRIOR_MEAN = np.log([PRIOR[name][0] for name in noise.PARAMETER_NAMES])
PRIOR_SIGMA = np.array([PRIOR[name][1] for name in noise.PARAMETER_NAMES])
SPREAD = (noise.SEGMENT, noise.WANDER)  # errors that parts of a run have of their own
