"""Looks at how a case stands to the body: gravity, travel, speeding up, turning."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.systems.trajectory.axis_hypotheses import attitudes, carry
from groundstation.systems.trajectory.mounting_settings import MountingSettings
from groundstation.systems.trajectory.short_spans import QUIET_MPS2, Spans, Steps, Sums

FEWEST = 5
ALIKE = 0.8  # correlation of turning of the nose and of the track of what flies nose first


@dataclass(frozen=True)
class Direction:
    """Mean of unit vectors in the axes of the case.

    Parameters
    ----------
    vector : ndarray, shape (3,)
        Of length 1; zeros without any.
    concentration : float
        Length of the mean: 1 where all agree.
    count : int
    """

    vector: FloatArray
    concentration: float
    count: int


@dataclass(frozen=True)
class Looks:
    """Independent looks at the body's axes, in the axes of the case or after the turn.

    Parameters
    ----------
    gravity, travel : Direction
        Down, from rest and steady travel; forward, from the velocity carried into the case.
    """

    gravity: Direction
    travel: Direction


def direction_of(vectors: FloatArray) -> Direction:
    """Return the mean direction of vectors, shape (n, 3)."""
    size = np.linalg.norm(vectors, axis=1)
    good = vectors[np.isfinite(size) & (size > 0.0)]
    if not len(good):
        return Direction(np.zeros(3), 0.0, 0)
    mean = (good / np.linalg.norm(good, axis=1)[:, None]).mean(axis=0)
    length = float(np.linalg.norm(mean))
    return Direction(mean / length if length > 0.0 else np.zeros(3), length, len(good))


def gravity_of(steps: Steps) -> Direction:
    """Return down by the specific force at rest and in steady travel."""
    calm = np.linalg.norm(steps.acceleration_mps2, axis=1) < QUIET_MPS2
    return direction_of(-steps.force_mps2[calm])


def looks_of(
    steps: Steps, spans: Spans, sums: Sums, lag_s: float, speed_min_mps: float, settings: MountingSettings
) -> Looks:
    """Return gravity and travel; the attitude of each span is that of Wahba's problem."""
    n_from_case = attitudes(spans, carry(spans, sums, settings), lag_s)
    fast = np.hypot(spans.velocity_mps[..., 0], spans.velocity_mps[..., 1]) >= speed_min_mps
    travel = direction_of(np.einsum("smij,smi->smj", n_from_case, spans.velocity_mps)[fast])
    gravity = gravity_of(steps)
    if gravity.count < FEWEST:
        gravity = direction_of(n_from_case[..., 2, :].reshape(-1, 3))
    return Looks(gravity, travel)


def measured_turn(looks: Looks) -> FloatArray:
    """Return body_from_case by gravity and by the level part of the travel, shape (3, 3)."""
    down = looks.gravity.vector
    forward = looks.travel.vector - down * (looks.travel.vector @ down)
    forward = forward / max(float(np.linalg.norm(forward)), 1e-9)
    return np.stack([forward, np.cross(down, forward), down])


@dataclass(frozen=True)
class Correlations:
    """Agreement of the turned unit with GNSS while it travels; NaN where nothing shows it.

    Parameters
    ----------
    along, across : float
        Correlation of forward force with the gain of speed, and of force to the right with speed times rate of track;
        of what rolls alone: a bank and the pull of an engine take them away.
    turning : float
        Correlation of the rate about down with the rate of track.
    turning_ratio : float
        Slope of the first over the second: 57 where rates are degrees as radians.
    count : int
    """

    along: float
    across: float
    turning: float
    turning_ratio: float
    count: int


def correlations(
    steps: Steps, sums: Sums, body_from_case: FloatArray, lag_s: float, speed_min: float, *, rolls: bool
) -> Correlations:
    """Return how the unit in body axes agrees with GNSS."""
    angle, gathered = sums.between(steps.start_s - lag_s, steps.end_s - lag_s)
    force = gathered @ body_from_case.T / steps.length_s[:, None]
    rate = angle @ body_from_case.T / steps.length_s[:, None]
    track_rate = steps.turned_rad / steps.length_s
    speed = steps.speed_mps
    with np.errstate(invalid="ignore", divide="ignore"):
        gain = (steps.acceleration_mps2[:, :2] * steps.velocity_mps[:, :2]).sum(axis=1) / speed
    good = (speed >= speed_min) & np.isfinite(force).all(axis=1) & np.isfinite(track_rate)
    good &= np.abs(track_rate) < 1.0  # a second at most a radian: beyond it the chord is no arc
    if good.sum() < FEWEST:
        return Correlations(np.nan, np.nan, np.nan, np.nan, int(good.sum()))
    track, turned = track_rate[good], rate[good, 2]
    size = float(track @ track)
    return Correlations(
        _correlation(force[good, 0], gain[good]) if rolls else np.nan,
        _correlation(force[good, 1], (speed * track_rate)[good]) if rolls else np.nan,
        _correlation(turned, track),
        float(turned @ track) / size if size > 0.0 else np.nan,
        int(good.sum()),
    )


def _correlation(one: FloatArray, other: FloatArray) -> float:
    if np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return float("nan")
    return float(np.corrcoef(one, other)[0, 1])


def flies_nose_first(steps: Steps, found: Correlations, settings: MountingSettings) -> bool:
    """Tell whether it moved on for long, the nose turning along with the track.

    A multicopter may fly in any direction of its body; one that does not is told from an aeroplane by its stops.
    """
    if not found.turning >= ALIKE:
        return False
    fast = steps.speed_mps >= settings.flight_speed_min_mps
    fast[1:] &= np.abs(steps.start_s[1:] - steps.end_s[:-1]) < 1e-6
    edges = np.flatnonzero(np.diff(np.concatenate([[0], fast.astype(np.int8), [0]])))
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        turned = float(np.nansum(np.abs(steps.turned_rad[start:end])))
        if (
            steps.end_s[end - 1] - steps.start_s[start] >= settings.flown_on_s
            and np.rad2deg(turned) >= settings.flown_turn_deg
        ):
            return True
    return False


def has_real_motion(spans: Spans, settings: MountingSettings) -> bool:
    """Tell whether GNSS shows motion that a unit cannot miss.

    Changes of velocity that last from step to step are motion; noise of a receiver changes its sign.
    """
    change = spans.wanted_mps[..., :2] - spans.wanted_mps[..., :2].mean(axis=1, keepdims=True)
    size = float(np.median(np.sqrt((change**2).sum(axis=2).mean(axis=1))))
    return size >= settings.unrelated_motion_mps and float((change[:, 1:] * change[:, :-1]).sum()) > 0.0
