"""True heading by a compass whose deviation is stated, as weak observations."""

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.methods import harmonics
from groundstation.systems.trajectory.inputs import CompassReadings
from groundstation.systems.trajectory.observations import Observations
from groundstation.systems.trajectory.sampling import at_times
from groundstation.systems.trajectory.solution import TrackOfStates
from groundstation.systems.trajectory.states import HEADING

EVERY_S = 10.0  # an observation
LASTS_S = 600.0  # twice the correlation time of its error: so long it counts once
STEEPEST_DEG = 30.0  # of roll and pitch: in steeper ones what is left of the vertical iron shows


def off_the_track(compass: CompassReadings, track: TrackOfStates) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return times, heading of the track, and heading by the compass minus it.

    They are medians of ten seconds. The field is levelled by roll and pitch of the track.
    """
    states = at_times(track, compass.time_s)
    levelled = _levelled_deg(compass.field_nt, states.roll_deg, states.pitch_deg)
    reading = np.where(np.isfinite(compass.heading_deg), compass.heading_deg, levelled)
    deviation = harmonics.design(reading) @ np.array(compass.deviation_deg)
    off = np.asarray(wrap_180(reading + deviation + compass.declination_deg - states.heading_deg))
    with np.errstate(invalid="ignore"):
        upright = (np.abs(states.roll_deg) < STEEPEST_DEG) & (np.abs(states.pitch_deg) < STEEPEST_DEG)
    rows = np.flatnonzero(np.isfinite(off) & upright)
    bins = np.floor(compass.time_s[rows] / EVERY_S)
    chosen = [rows[bins == one] for one in np.unique(bins)]
    middle = np.array([part[len(part) // 2] for part in chosen], dtype=np.int64)
    turned = [_median_deg(off[part]) for part in chosen]
    return compass.time_s[middle], states.heading_deg[middle], np.array(turned)


def _median_deg(off_deg: FloatArray) -> float:
    """Return the median of differences about their mean direction."""
    mean = float(np.degrees(np.angle(np.mean(np.exp(1j * np.radians(off_deg))))))
    return float(wrap_180(mean + np.median(np.asarray(wrap_180(off_deg - mean)))))


def _levelled_deg(field_nt: FloatArray, roll_deg: FloatArray, pitch_deg: FloatArray) -> FloatArray:
    """Return the magnetic heading of a field along body axes (k, 3).

    North lies where its level part points.
    """
    roll, pitch = np.radians(roll_deg), np.radians(pitch_deg)
    forward, right, down = field_nt.T
    ahead = np.cos(pitch) * forward + np.sin(pitch) * (np.sin(roll) * right + np.cos(roll) * down)
    aside = np.cos(roll) * right - np.sin(roll) * down
    return np.asarray(np.degrees(np.arctan2(-aside, ahead)))


def observations_of(compass: CompassReadings, track: TrackOfStates) -> Observations:
    """Return a heading every ten seconds.

    The error of a compass lasts: all observations of ten minutes together say what one of them does.
    """
    time_s, heading_deg, off_deg = off_the_track(compass, track)
    count = len(time_s)
    alike = max(1.0, min(float(count), LASTS_S / EVERY_S))
    value, variance = np.full((count, 3), np.nan), np.full((count, 3), np.nan)
    value[:, 0] = np.radians(np.asarray(wrap_180(heading_deg + off_deg)))
    variance[:, 0] = np.radians(compass.sigma_deg) ** 2 * alike
    kind = np.full(count, HEADING, dtype=np.int64)
    return Observations(time_s, kind, value, variance, np.zeros(count, dtype=bool), np.zeros((count, 3)))
