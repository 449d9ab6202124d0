"""Schuler oscillation of a velocity error by plain least squares over a flight."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.systems.inertial.cause_answer import Within95
from groundstation.systems.inertial.cause_legs import RECEIVER

COSINE, SINE = 2, 3  # behind offset and slope
LEAST_TURNS = 1.0  # of the oscillation in a flight


@dataclass(frozen=True)
class FlightWave:
    """Oscillation of both channels over a flight.

    ``amplitude_mps`` north and east, ``share`` of the mean square error that it is.
    """

    amplitude_mps: tuple[Within95, Within95]
    share: float


def flight_wave(time_s: FloatArray, velocity_mps: FloatArray, schuler_radps: float) -> FlightWave | None:
    """Fit offset, slope, cosine and sine of the Schuler rate to both channels.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    velocity_mps : ndarray, shape (n, 2)
        NaN where absent.
    schuler_radps : float

    Returns
    -------
    FlightWave or None
        None of a flight shorter than a Schuler period. The interval is that of GNSS with its slow errors: what the
        oscillation of this flight was, and not what would be on another one.

    Examples
    --------
    >>> time_s = np.arange(0.0, 9000.0, 10.0)
    >>> wave = flight_wave(time_s, np.outer(np.cos(1.24e-3 * time_s - 1.0), [0.5, 0.0]), 1.24e-3)
    >>> round(wave.amplitude_mps[0].value, 6), round(wave.share, 2)
    (0.5, 1.0)
    """
    known = np.isfinite(velocity_mps).all(axis=1)
    since, error = time_s[known] - time_s[0], velocity_mps[known]
    span_s = float(np.ptp(since)) if len(since) else 0.0
    if span_s * schuler_radps < LEAST_TURNS * 2.0 * np.pi:
        return None
    angle = schuler_radps * since
    columns = np.stack([np.ones_like(since), since / span_s, np.cos(angle), np.sin(angle)], axis=1)
    fitted, *_ = np.linalg.lstsq(columns, error, rcond=None)
    swing = columns[:, [COSINE, SINE]] @ fitted[[COSINE, SINE]]
    spectral = (
        RECEIVER.velocity_white_mps**2 * span_s / len(since)
        + 2.0 * RECEIVER.velocity_correlated_mps**2 * RECEIVER.velocity_correlation_s
    )
    unit = np.linalg.inv(columns.T @ columns / len(since))
    half = NORMAL_95 * float(np.sqrt(spectral / span_s * max(unit[COSINE, COSINE], unit[SINE, SINE])))
    north, east = (
        Within95(size, max(size - half, 0.0), size + half) for size in np.hypot(*fitted[[COSINE, SINE]]).tolist()
    )
    total = float(np.sum(np.square(error)))
    return FlightWave((north, east), float(np.sum(swing * error)) / total if total > 0.0 else 0.0)
