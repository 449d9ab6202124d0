"""Error of recorded positions across the course; the reference is the localizer.

The localizer is a line that needs no GNSS.

Across the runway the localizer says where the aircraft is: deviation times the width of the course there. What the
positions say beyond it is their error, fitted as e(t) = e0 + r t, t counted from the threshold, by generalised least
squares. The covariance of the observations holds all that is not noise of a sample: tolerance of the mean course line,
its bends, its width, coordinates and bearing of the runway, steps in which positions are written, curvature of the
error over some minutes. Source of the tolerances: ICAO Annex 10, volume I, 3.1.3.4, 3.1.3.6 and 3.1.3.7. Ignored: the
distance between antennas, filters of the receiver (a final is flown slowly across the course).
"""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import MEAN_RADIUS_M, continuous_longitude_deg
from groundstation.base.records import BoolArray
from groundstation.base.units import M_PER_NAUTICAL_MILE, S_PER_H
from groundstation.results.landing_categories import LINEAR_95
from groundstation.systems.landing.answer import ErrorPart, PositionError, RunwayUsed, Sensitivity
from groundstation.systems.landing.geometry import along_and_across, metres_per_dot
from groundstation.systems.landing.settings import LandingSettings

Rows = NDArray[np.intp]

# Samples.
FEWEST_SAMPLES = 20  # on the localizer, below which nothing is fitted
MOST_SAMPLES = 400  # of more, every k-th: the covariance has their number squared
FEWEST_ON_GROUND = 3  # that make a roll-out

# Sensitivity of the localizer.
FARTHEST_M = 30_000.0  # from the threshold; beyond it deviations do not count
SATURATED_DOTS = 2.0  # the needle is at its stop
LEAST_MOVE_M = 100.0  # across the course, below which the ratio shows nothing
SAMPLES_ALIKE = 5.0  # so many neighbours say what one does
SURE_SENSITIVITY, SURE_SIGMAS = (0.5, 2.0), 3.0  # a ratio surely outside is of another sense or width

# Parts of the covariance.
FULL_SCALE_DDM = 0.155  # of a localizer, at the edge of its course sector (ICAO 3.1.3.7)
UNEVEN_S = 120.0  # a step of a coordinate that takes so long is not crossed evenly at all
FEW_STEPS = 4  # a coordinate that crosses fewer shows little of its own drift
BEARING, THRESHOLD, ROUNDING, CURVATURE = (
    *("bearing of the runway", "place of the threshold", "rounding of the positions", "curvature of the error"),
)
COMMON = (BEARING, THRESHOLD, ROUNDING, CURVATURE)  # to final and roll-out, or told apart
LINE, WIDTH = "mean course line", "width of the course"
SYSTEMATIC = (*COMMON, LINE, WIDTH)  # common to all samples: no residual shows them, and none widens them

# Result.
AT_THRESHOLD, RATE = np.array([1.0, 0.0]), np.array([0.0, 1.0])  # weights of the state: the error there, its growth
SHORTEST_DRIFT_S = 600.0  # of flight, below which no drift per hour is told


@dataclass(frozen=True, eq=False)
class Positions:
    """Positions of one topic on a final and its roll-out, and their resolution.

    Times count from the threshold, in seconds. ``step_deg``: steps of latitude and longitude, 0 where they are too fine
    to count.
    """

    topic: str
    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    step_deg: tuple[float, float]


def sensitivity_of(
    time_s: FloatArray,
    dots: FloatArray,
    distance_m: FloatArray,
    across_m: FloatArray,
    runway: RunwayUsed,
    step_m: float,
) -> Sensitivity:
    """Regress positions across the course on the localizer's deviation, with a steady drift.

    Samples with the needle at its stop are left out. There is a result where the aircraft moved enough across the
    course.
    """
    shown_m = dots * metres_per_dot(distance_m, runway)
    useful = np.isfinite(shown_m) & np.isfinite(across_m) & (np.abs(dots) < SATURATED_DOTS)
    useful &= (distance_m > 0.0) & (distance_m < FARTHEST_M)
    across, shown, since = across_m[useful], shown_m[useful], time_s[useful]
    if len(across) < FEWEST_SAMPLES or np.ptp(shown) < max(2.0 * step_m, LEAST_MOVE_M):
        return Sensitivity(None, None, len(across))
    design = np.stack([shown, np.ones(len(shown)), since - since.mean()], axis=1)
    state, _rest, rank, _sizes = np.linalg.lstsq(design, across, rcond=None)
    if rank < design.shape[1]:
        return Sensitivity(None, None, len(across))
    rest = across - design @ state
    alike = SAMPLES_ALIKE * float(rest @ rest) / (len(across) - 3)  # neighbours say nearly the same
    sigma = float(np.sqrt(alike * np.linalg.inv(design.T @ design)[0, 0]))
    return Sensitivity(float(state[0]), sigma, len(across))


def fits(sensitivity: Sensitivity) -> bool:
    """Tell whether a localizer may serve as reference.

    A localizer may unless its sense or width is surely another.
    """
    if sensitivity.ratio is None or sensitivity.sigma is None:
        return True
    reach = SURE_SIGMAS * sensitivity.sigma
    return sensitivity.ratio + reach >= SURE_SENSITIVITY[0] and sensitivity.ratio - reach <= SURE_SENSITIVITY[1]


def position_error(
    positions: Positions,
    dots: FloatArray,
    on_course: BoolArray,
    on_ground: BoolArray,
    runway: RunwayUsed,
    flown_s: float,
    settings: LandingSettings,
) -> PositionError:
    """Fit the error of positions across the course.

    Parameters
    ----------
    positions : Positions, n samples
    dots : ndarray, shape (n,)
        Deviation from the localizer, right of the course positive.
    on_course, on_ground : ndarray of bool, shape (n,)
        Samples on the guidance, and of the roll-out.
    runway : RunwayUsed
    flown_s : float
        Time since the flight began as the threshold is crossed.
    """
    distance_m, across_m = along_and_across(positions.latitude_deg, positions.longitude_deg, runway)
    shown_m = dots * metres_per_dot(distance_m, runway)
    used = np.flatnonzero(on_course & np.isfinite(across_m) & np.isfinite(shown_m) & (distance_m > 0.0))
    used = used[:: max(-(-len(used) // MOST_SAMPLES), 1)]
    if len(used) < FEWEST_SAMPLES:
        return PositionError(positions.topic, "not measured", "too few samples on the localizer", len(used))
    parts = _parts(positions, used, distance_m, shown_m, runway, settings)
    fit = _fitted(positions.time_s[used], across_m[used] - shown_m[used], parts)
    rolled = _roll_out(
        positions, np.flatnonzero(on_ground & np.isfinite(across_m)), across_m, distance_m, runway, settings
    )
    change_m, change_sigma_m = (None, None) if rolled is None else _change(rolled, fit, settings)
    told = PositionError(
        positions.topic,
        "not measured",
        "these positions placed the runway: only changes after the final show",
        len(used),
        change_m=change_m,
        change_sigma_m=change_sigma_m,
        residual_ratio=fit.residual_ratio,
    )
    if not runway.is_surveyed:
        return told
    error_m, sigma_m, rate_sigma_mps = float(fit.state[0]), fit.sigma(AT_THRESHOLD), fit.sigma(RATE)
    half_m = LINEAR_95 * sigma_m
    return replace(
        told,
        state="measured",
        reason="",
        error_m=error_m,
        sigma_m=sigma_m,
        confidence95_m=(error_m - half_m, error_m + half_m),
        rate_mps=float(fit.state[1]),
        rate_sigma_mps=rate_sigma_mps,
        rollout_error_m=None if rolled is None else rolled.mean_m,
        rollout_sigma_m=None if rolled is None else rolled.sigma_m,
        drift_nmi_per_h=abs(error_m) / M_PER_NAUTICAL_MILE / (flown_s / S_PER_H)
        if flown_s > SHORTEST_DRIFT_S
        else None,
        parts=tuple(ErrorPart(name, fit.sigma_of(name, AT_THRESHOLD)) for name, _part in parts),
    )


def _drift_nmi_per_h(error_m: float, flown_s: float) -> float | None:
    return abs(error_m) / M_PER_NAUTICAL_MILE / (flown_s / S_PER_H) if flown_s > SHORTEST_DRIFT_S else None


@dataclass(frozen=True, eq=False)
class _Fit:
    """Error and its rate at the threshold.

    ``gain`` (n, 2) makes them of the observations at ``time_s``.
    """

    time_s: FloatArray
    parts: tuple[tuple[str, FloatArray], ...]
    state: FloatArray
    gain: FloatArray
    residual_ratio: float

    def sigma_of(self, name: str, weights: FloatArray) -> float:
        """Return the share of a covariance part in the sigma of ``weights`` times the state.

        Residuals larger than expected widen what is noise, not what is common to all samples.
        """
        wider = 1.0 if name in SYSTEMATIC else max(self.residual_ratio, 1.0)
        along = self.gain @ weights
        return wider * math.sqrt(max(float(along @ dict(self.parts)[name] @ along), 0.0))

    def sigma(self, weights: FloatArray, without: tuple[str, ...] = ()) -> float:
        """Sigma of ``weights`` times the state, some parts left out."""
        return math.hypot(*[self.sigma_of(name, weights) for name, _part in self.parts if name not in without])


def _fitted(time_s: FloatArray, measured_m: FloatArray, parts: tuple[tuple[str, FloatArray], ...]) -> _Fit:
    """Generalised least squares."""
    design = np.stack([np.ones(len(time_s)), time_s], axis=1)
    white = np.linalg.cholesky(np.sum([part for _name, part in parts], axis=0))
    scaled, target = np.linalg.solve(white, design), np.linalg.solve(white, measured_m)
    normal = np.linalg.inv(scaled.T @ scaled)
    state = normal @ scaled.T @ target
    ratio = float(np.sqrt(np.sum((target - scaled @ state) ** 2) / (len(time_s) - 2)))
    return _Fit(time_s, parts, state, np.linalg.solve(white.T, scaled @ normal), ratio)


def _parts(
    positions: Positions,
    used: Rows,
    distance_m: FloatArray,
    shown_m: FloatArray,
    runway: RunwayUsed,
    settings: LandingSettings,
) -> tuple[tuple[str, FloatArray], ...]:
    """Covariances of the observations by cause, shape (n, n) each."""
    distance, time_s = distance_m[used], positions.time_s[used]
    widening = 1.0 + distance / runway.localizer_distance_m
    line = 0.5 * settings.course_line_m * widening  # tolerances as 95 %
    bend_m = 0.5 * settings.bend_ddm / FULL_SCALE_DDM * 0.5 * runway.localizer_width_m * widening
    alike = np.exp(-np.abs(distance[:, None] - distance) / settings.bend_length_m)
    width = 0.5 * settings.width_share * shown_m[used]
    bearing = np.deg2rad(runway.course_sigma_deg) * distance
    curvature = 0.5 * settings.position_curvature_mps2 * time_s**2
    return (
        (LINE, np.outer(line, line)),
        ("bends of the course", np.outer(bend_m, bend_m) * alike),
        (WIDTH, np.outer(width, width)),
        (BEARING, np.outer(bearing, bearing)),
        (THRESHOLD, np.full((len(used), len(used)), _across_sigma_m(runway, settings) ** 2)),
        ("steps of the positions", _steps(positions, used, runway)),
        (ROUNDING, np.full((len(used), len(used)), _rounding_m(positions, runway, settings) ** 2)),
        (CURVATURE, np.outer(curvature, curvature)),
        ("noise of the positions", np.eye(len(used)) * settings.position_noise_m**2),
    )


def _across_sigma_m(runway: RunwayUsed, settings: LandingSettings) -> float:
    """Return the sigma of the threshold across the course: of the table, else of a survey."""
    return settings.threshold_sigma_m if runway.across_sigma_m is None else runway.across_sigma_m


def step_across_m(positions: Positions, runway: RunwayUsed) -> FloatArray:
    """Return the size across the course of a step of latitude and of longitude, metres."""
    north_m = np.deg2rad(positions.step_deg[0]) * MEAN_RADIUS_M
    east_m = np.deg2rad(positions.step_deg[1]) * MEAN_RADIUS_M * np.cos(np.deg2rad(runway.latitude_deg))
    course_rad = np.deg2rad(runway.true_course_deg)
    return np.asarray(np.abs([north_m * np.sin(course_rad), east_m * np.cos(course_rad)]))


def _steps(positions: Positions, used: Rows, runway: RunwayUsed) -> FloatArray:
    """Covariance of the rounding of stepped coordinates.

    While a coordinate crosses a step evenly, its rounding error is a sawtooth: samples a share u of the step apart
    correlate as 1 - 6 u (1 - u), a whole step has mean zero. The longer it takes, the less even it is; in a step that
    is not crossed from one side to the other the error may lie and drift anywhere. Errors of different steps are
    independent; a coordinate that crosses few of them shows little of its own drift.
    """
    total = np.zeros((len(used), len(used)))
    time_s = positions.time_s[used]
    coordinates = (positions.latitude_deg[used], continuous_longitude_deg(positions.longitude_deg[used]))
    for size_m, step_deg, values in zip(step_across_m(positions, runway), positions.step_deg, coordinates, strict=True):
        if step_deg <= 0.0:
            continue
        alike, crossed = np.zeros_like(total), 0
        change = np.sign(np.diff(values)) * (np.abs(np.diff(values)) > 0.5 * step_deg)
        edges = [0, *(np.flatnonzero(change) + 1).tolist(), len(values)]
        for first, last in pairwise(edges):
            is_crossed = first > 0 and last < len(values) and change[first - 1] == change[last - 1]
            uneven = min((time_s[last - 1] - time_s[first]) / UNEVEN_S, 1.0) if is_crossed else 1.0
            place = np.arange(last - first) / (last - first)
            apart = np.abs(place[:, None] - place)
            sawtooth = 1.0 - 6.0 * apart * (1.0 - apart)
            alike[first:last, first:last] = (1.0 - uneven) * sawtooth + uneven * _drifting(place)
            crossed += is_crossed
        if crossed < FEW_STEPS:
            alike += _drifting(np.linspace(0.0, 1.0, len(values)))
        total += size_m**2 / 12.0 * alike
    return total


def _drifting(place: FloatArray) -> FloatArray:
    """Return the covariance of an error that drifts from one uniform value to another.

    The covariance is a multiple of that of one uniform error; ``place`` is in [0, 1].
    """
    return np.asarray(0.5 + np.outer(1.0 - place, 1.0 - place) + np.outer(place, place))


def _rounding_m(positions: Positions, runway: RunwayUsed, settings: LandingSettings) -> float:
    """Return the sigma of a shift of all positions by truncation, where nobody tells of it.

    Cut off instead of rounded, each coordinate lies half a step too low. It is nothing or the whole of it; both
    coordinates may add up.
    """
    if settings.positions_rounded != "unknown":
        return 0.0
    return float(0.5 * np.sum(step_across_m(positions, runway)) / np.sqrt(2.0))


@dataclass(frozen=True)
class _RollOut:
    """Mean displacement on the roll-out, its time and its sigmas.

    ``sigma_m`` is with the centre line for truth, ``own_sigma_m`` that of the mean alone.
    """

    mean_m: float
    at_s: float
    sigma_m: float
    own_sigma_m: float


def _roll_out(
    positions: Positions,
    rows: Rows,
    across_m: FloatArray,
    distance_m: FloatArray,
    runway: RunwayUsed,
    settings: LandingSettings,
) -> _RollOut | None:
    """The roll-out, None where there is none."""
    if len(rows) < FEWEST_ON_GROUND:
        return None
    steps_m = float(np.sqrt(np.mean(_steps(positions, rows, runway))))
    bearing_m = np.deg2rad(runway.course_sigma_deg) * float(np.mean(distance_m[rows]))
    own_m = math.hypot(settings.centre_line_sigma_m, settings.position_noise_m / math.sqrt(len(rows)), steps_m)
    shift_m = _rounding_m(positions, runway, settings)
    whole_m = math.hypot(own_m, bearing_m, _across_sigma_m(runway, settings), shift_m)
    return _RollOut(float(np.mean(across_m[rows])), float(np.mean(positions.time_s[rows])), whole_m, own_m)


def _change(rolled: _RollOut, fit: _Fit, settings: LandingSettings) -> tuple[float, float]:
    """Roll-out minus the error of the final continued to it, and its sigma.

    Bearing and place of the runway and the rounding of the positions shift both alike and drop out.
    """
    weights = np.array([1.0, rolled.at_s])
    continued_m = float(weights @ fit.state)
    bent_s2 = rolled.at_s**2 - float(fit.gain @ weights @ fit.time_s**2)
    bend_m = 0.5 * settings.position_curvature_mps2 * bent_s2
    return rolled.mean_m - continued_m, math.hypot(rolled.own_sigma_m, bend_m, fit.sigma(weights, COMMON))
