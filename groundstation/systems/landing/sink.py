"""Sink rate onto the runway over the last second before a touchdown, with its sigma."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.systems.landing.evidence import Evidence
from groundstation.systems.landing.ground import LATE_S, SPEED_NOISE_MPS, UNEVEN, Ground, Heights
from groundstation.systems.landing.touchdown_answer import SINK_S

WINDOW_S = 2.5  # of a height before the touchdown, or four of its samples
SPEED_WINDOW_S = 1.6
UNSTEADY_MPS = 0.1  # of a flare that is no parabola


@dataclass(frozen=True)
class SinkRate:
    """Sink rate, its sigma, and the topic that shows it."""

    rate_mps: float
    sigma_mps: float | None
    topic: str


def sink_rate_of(evidence: Evidence) -> SinkRate | None:
    """Return the sink rate of the source that shows it best; None where none does."""
    found = []
    for heights, ground in evidence.heights:
        found += [_by_height(heights, ground, evidence), _by_speed(heights, ground, evidence)]
    return min((one for one in found if one is not None), key=lambda one: one.sigma_mps or np.inf, default=None)


def _by_height(heights: Heights, ground: Ground | None, evidence: Evidence) -> SinkRate | None:
    """Slope of a parabola through the last heights, at the middle of the last second."""
    late_s = LATE_S if heights.kind.topic_kind == "gnss" else 0.0
    since = heights.time_s - evidence.time_s - late_s
    rate = heights.rate_hz
    window_s = max(WINDOW_S, 4.2 / max(rate, 0.1))
    rows = (since <= 0.0) & (since >= -window_s)
    if rows.sum() < 3:
        return None
    design = np.stack([np.ones(rows.sum()), since[rows] + 0.5 * SINK_S, (since[rows] + 0.5 * SINK_S) ** 2], axis=-1)
    noise = max(heights.kind.noise_m, ground.noise_m if ground is not None else 0.0)
    prior = np.diag([0.0, 0.0, 1.0 / 0.5**2])  # a flare changes the sink rate by some 1 m/s each second
    covariance = np.linalg.inv(design.T @ design / noise**2 + prior)
    fitted = covariance @ (design.T @ heights.height_m[rows]) / noise**2
    unsteady = UNSTEADY_MPS * (window_s / WINDOW_S) ** 1.5
    risen = 0.0 if ground is None else heights.kind.uneven * _speed(heights, evidence)
    sigma = np.sqrt(covariance[1, 1] + (2.0 * fitted[2] * evidence.sigma_s) ** 2 + unsteady**2 + risen**2)
    return SinkRate(_onto(-float(fitted[1]), heights, ground, evidence), float(sigma), heights.topic)


def _by_speed(heights: Heights, ground: Ground | None, evidence: Evidence) -> SinkRate | None:
    """Mean of the last vertical speeds, brought to the middle of the last second."""
    late_s = LATE_S if heights.kind.topic_kind == "gnss" else 0.0
    since = heights.time_s - evidence.time_s - late_s
    rows = (since <= 0.0) & (since >= -max(SPEED_WINDOW_S, 2.2 / max(heights.rate_hz, 0.1)))
    rows &= np.isfinite(heights.down_mps)
    if rows.sum() < 2 or ground is None:
        return None
    at = since[rows] + 0.5 * SINK_S
    design = np.stack([np.ones(len(at)), at], axis=-1)
    prior = np.diag([0.0, 1.0])
    covariance = np.linalg.inv(design.T @ design / SPEED_NOISE_MPS**2 + prior)
    fitted = covariance @ (design.T @ heights.down_mps[rows]) / SPEED_NOISE_MPS**2
    risen = UNEVEN * _speed(heights, evidence)
    sigma = np.sqrt(covariance[0, 0] + (fitted[1] * evidence.sigma_s) ** 2 + UNSTEADY_MPS**2 + risen**2)
    return SinkRate(_onto(float(fitted[0]), heights, ground, evidence), float(sigma), heights.topic)


def _speed(heights: Heights, evidence: Evidence) -> float:
    return float(np.interp(evidence.time_s, heights.time_s, heights.speed_mps))


def _onto(down_mps: float, heights: Heights, ground: Ground | None, evidence: Evidence) -> float:
    """Return the sink rate onto a runway that rises; a height above the ground has it already."""
    if ground is None or heights.kind.counts_from_ground:
        return down_mps
    return down_mps + ground.slope * _speed(heights, evidence)


def rate_before(time_s: FloatArray, height_m: FloatArray, at_s: float, source: str) -> SinkRate | None:
    """Return the slope of a height over the last seconds, without a sigma.

    It serves where there is no evidence.
    """
    rows = (time_s >= at_s - SINK_S - 2.0) & (time_s <= at_s) & np.isfinite(height_m)
    if rows.sum() < 2:
        return None
    return SinkRate(-float(np.polyfit(time_s[rows], height_m[rows], 1)[0]), None, source)
