"""Errors of an unaided INS by cause: shares, Schuler, constants, legs, windows."""

from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.nearest import nearest_rows
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import Int64Array
from groundstation.methods.ins_noise import RADPS_PER_DPH
from groundstation.systems.inertial.cause_answer import (
    CAUSES,
    Cause,
    CauseParameter,
    CauseShare,
    CausesResult,
    ErrorWindow,
    ParameterName,
    SchulerWave,
    Within95,
    taken_away,
)
from groundstation.systems.inertial.cause_arrays import CausesAlong, CausesOverTime, PartsOfChannel
from groundstation.systems.inertial.cause_fit import (
    AZ,
    BIAS_FORWARD,
    BIAS_RIGHT,
    DRIFT_E,
    DRIFT_N,
    GYRO_E,
    GYRO_N,
    TINY,
    CauseFit,
    fit_causes,
)
from groundstation.systems.inertial.cause_legs import straight_legs, track_errors
from groundstation.systems.inertial.cause_wave import FlightWave, flight_wave
from groundstation.systems.inertial.coupled import MPS2_PER_UG
from groundstation.systems.inertial.differences import TRACK_MPS, InsDifferences
from groundstation.systems.inertial.figures import ARCSEC_PER_RAD, CHANNELS, thinned
from groundstation.systems.inertial.filter import ChannelsRun

WINDOW_HOURS = (0.5, 1.0, 2.0, 3.0)
WINDOW_STEP_S, NEAR_S, S_PER_H = 300.0, 30.0, 3600.0
ONE_HEADING = 0.02  # spread of headings within some 11 deg of their mean
LEAST_SHARE = 0.01  # sigma of a share by what the columns leave out: means over ten seconds of turns, scale factors
HALF = 0.5  # observability above which a constant counts as seen
MOST_PHASE_DEG = 90.0
TAIL = 0.025
DRAWS, SEED = 4000, 48  # of amplitudes, which are not Gaussian; the same for every flight
OF_CAUSE: dict[Cause, str] = {
    "drift": "the constant drift of its channels",
    "azimuth": "the azimuth error in turns",
    "body": "accelerometer biases and gyro drifts that turned with the aircraft",
    "reset": "the jumps at resets",
    "unexplained": "left over by all constants: random drift, gravity, GNSS",
}


def assess_causes(differences: InsDifferences, run: ChannelsRun, start_s: float | None = None) -> CausesResult:
    """Return the errors of an unaided INS by cause.

    Parameters
    ----------
    differences : InsDifferences
    run : ChannelsRun
        Of the separate channels over the same epochs.
    start_s : float, optional
        When navigation began, flight seconds.

    Raises
    ------
    NotAssessableError
        See :func:`cause_fit.fit_causes`.
    """
    fit = fit_causes(differences, run)
    position, velocity = run.measured(0), run.measured(1)
    legs, left_out = straight_legs(differences, position, velocity)
    track = track_errors(differences, position, velocity)
    rng = np.random.default_rng(SEED)
    start = _amplitude(fit.start_rows @ fit.value, fit.start_rows @ fit.covariance @ fit.start_rows.T, rng)
    shares = _shares(fit)
    wave = flight_wave(fit.time_s, fit.measured[:, 2:], fit.schuler_radps)
    parameters = _parameters(fit, is_strapdown=run.noise.is_strapdown)
    spread = heading_spread(differences)
    rows = thinned(len(run.epochs))
    return CausesResult(
        ins_topic=differences.ins_topic,
        gnss_topic=differences.gnss_topic,
        ins_class=run.noise.name,
        sentence=_sentence(shares, parameters, start, _tilt(fit, start), wave),
        hours=float(fit.time_s[-1] - fit.time_s[0]) / S_PER_H,
        schuler_period_min=run.model.schuler_period_min,
        heading_spread=spread,
        is_parted=spread > ONE_HEADING,
        is_strapdown=run.noise.is_strapdown,
        resets=fit.resets,
        start_mps=start,
        start_tilt_arcsec=_tilt(fit, start),
        shares=shares,
        parameters=parameters,
        schuler=_schuler(fit, wave, rng),
        legs=legs,
        legs_left_out=left_out,
        windows=error_windows(run, position, start_s),
        along_across=track.rms(),
        period_share=None if wave is None else wave.share,
        figures=(
            _over_time(fit),
            CausesAlong(
                time_s=run.epochs.time_s[rows],
                along_mps=track.along_mps[rows],
                across_mps=track.across_mps[rows],
                along_m=track.along_m[rows],
                across_m=track.across_m[rows],
            ),
        ),
    )


def heading_spread(differences: InsDifferences) -> float:
    """Return 1 - length of the mean heading as a unit vector while moving; 0 on one heading."""
    moving = np.hypot(*np.nan_to_num(differences.velocity_mps).T) > TRACK_MPS
    heading = differences.unwrapped_heading_rad[moving]
    return float(1.0 - np.abs(np.mean(np.exp(1j * heading)))) if len(heading) else 0.0


def _gaussian(value: float, sigma: float) -> Within95:
    return Within95(value, value - NORMAL_95 * sigma, value + NORMAL_95 * sigma)


def _drawn(mean: FloatArray, covariance: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Draws of a Gaussian, shape (:data:`DRAWS`, k)."""
    eigenvalue, vector = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root = vector * np.sqrt(np.maximum(eigenvalue, 0.0))
    return np.asarray(mean + rng.standard_normal((DRAWS, len(mean))) @ root.T)


def _between(draws: FloatArray) -> Within95:
    low, middle, high = np.quantile(draws, [TAIL, 0.5, 1.0 - TAIL])
    return Within95(float(middle), float(low), float(high))


def _amplitude(mean: FloatArray, covariance: FloatArray, rng: np.random.Generator) -> Within95:
    """Return the length of a Gaussian vector: median and 95 % of its distribution."""
    return _between(np.sqrt(np.sum(np.square(_drawn(mean, covariance, rng)), axis=1)))


def _scaled(one: Within95, factor: float) -> Within95:
    return Within95(factor * one.value, factor * one.low95, factor * one.high95)


def _tilt(fit: CauseFit, amplitude: Within95) -> Within95:
    """Return the initial tilt that makes a Schuler amplitude, arcsec."""
    return _scaled(amplitude, fit.schuler_radps / fit.gravity_mps2 * ARCSEC_PER_RAD)


def share_rows(fit: CauseFit, velocity_mps: FloatArray) -> dict[str, FloatArray]:
    """Return shares of causes in a mean square velocity error (n, 2), as rows (p,).

    A share is the mean of part x error over the mean of error x error: linear in the constants.
    """
    error = np.where(np.isfinite(velocity_mps), velocity_mps, 0.0)
    total = max(float(np.sum(np.square(error))), TINY)
    return {name: np.einsum("nc,ncp->p", error, part) / total for name, part in fit.parts().items()}


def _shares(fit: CauseFit) -> tuple[CauseShare, ...]:
    rows = share_rows(fit, fit.measured[:, 2:])
    every = sum(rows.values(), np.zeros(len(fit.value)))
    found = []
    for name in CAUSES:
        row = every if name == "unexplained" else rows[name]
        least = 0.0 if name == "reset" and not fit.resets else LEAST_SHARE
        value, sigma = float(row @ fit.value), float(np.hypot(_sigma(row, fit.covariance), least))
        found.append(CauseShare(name, _gaussian(1.0 - value if name == "unexplained" else value, sigma)))
    return tuple(found)


def _sigma(row: FloatArray, covariance: FloatArray) -> float:
    return float(np.sqrt(max(float(row @ covariance @ row), 0.0)))


class CauseRow(NamedTuple):
    """A figure that is linear in the constants: name, title, unit, unit of it in SI, row (p,)."""

    name: ParameterName
    title: str
    unit: str
    factor: float
    row: FloatArray


def parameter_rows(fit: CauseFit, *, is_strapdown: bool) -> tuple[CauseRow, ...]:
    """Return the constants that are told, as rows."""
    unit = np.eye(len(fit.value))
    dph, ug = 1.0 / RADPS_PER_DPH, 1.0 / MPS2_PER_UG
    body = (
        CauseRow("drift_north", "drift of the north channel that does not turn", "dph", dph, unit[DRIFT_N]),
        CauseRow("drift_east", "drift of the east channel that does not turn", "dph", dph, unit[DRIFT_E]),
        CauseRow("gyro_forward", "gyro drift about the nose", "dph", -dph, unit[GYRO_E]),
        CauseRow("gyro_right", "gyro drift about the right wing", "dph", dph, unit[GYRO_N]),
    )
    along, right = ("forward", "right") if is_strapdown else ("north", "east")
    return (
        CauseRow("mean_drift_north", "mean drift of the north channel", "dph", dph, fit.drift_rows[0]),
        CauseRow("mean_drift_east", "mean drift of the east channel", "dph", dph, fit.drift_rows[1]),
        *(body if is_strapdown else ()),
        CauseRow("accelerometer_forward", f"accelerometer bias {along}", "ug", ug, unit[BIAS_FORWARD]),
        CauseRow("accelerometer_right", f"accelerometer bias {right}", "ug", ug, unit[BIAS_RIGHT]),
        CauseRow("tilt_north", "tilt at the start, north channel", "arcsec", ARCSEC_PER_RAD, fit.tilt_rows[0]),
        CauseRow("tilt_east", "tilt at the start, east channel", "arcsec", ARCSEC_PER_RAD, fit.tilt_rows[1]),
        CauseRow("azimuth", "azimuth error at the start", "deg", float(np.rad2deg(1.0)), unit[AZ]),
    )


def _parameters(fit: CauseFit, *, is_strapdown: bool) -> tuple[CauseParameter, ...]:
    found = []
    for one in parameter_rows(fit, is_strapdown=is_strapdown):
        before, after = _sigma(one.row, fit.prior), _sigma(one.row, fit.covariance)
        if before <= 0.0:
            continue  # the class leaves it out
        seen = min(max(1.0 - after / before, 0.0), 1.0)
        value, half = one.factor * float(one.row @ fit.value), NORMAL_95 * abs(one.factor) * after
        found.append(CauseParameter(one.name, one.title, one.unit, value, half, seen, seen > HALF))
    return tuple(found)


def _schuler(fit: CauseFit, wave: FlightWave | None, rng: np.random.Generator) -> tuple[SchulerWave, ...]:
    start, end = fit.schuler_rows, fit.end_rows
    last = fit.end_offset + end @ fit.value
    last_covariance = fit.end_covariance + end @ fit.covariance @ end.T
    found = []
    for channel, name in enumerate(CHANNELS):
        use = slice(2 * channel, 2 * channel + 2)
        draws = _drawn(start[use] @ fit.value, start[use] @ fit.covariance @ start[use].T, rng)
        amplitude = _between(np.hypot(*draws.T))
        drift = -fit.radius_m * fit.drift_rows[channel]
        found.append(
            SchulerWave(
                channel=name,
                amplitude_mps=amplitude,
                phase_deg=_phase(draws),
                tilt_arcsec=_tilt(fit, amplitude),
                bias_ug=_scaled(amplitude, fit.schuler_radps / MPS2_PER_UG),
                offset_mps=_gaussian(float(drift @ fit.value), _sigma(drift, fit.covariance)),
                end_mps=_amplitude(last[use], last_covariance[use, use], rng),
                flight_mps=None if wave is None else wave.amplitude_mps[channel],
            )
        )
    return tuple(found)


def _phase(draws: FloatArray) -> Within95 | None:
    """Return the phase of draws (k, 2) of cosine and sine; None where it may be any."""
    cosine, sine = draws.T
    middle = float(np.rad2deg(np.arctan2(sine.mean(), cosine.mean())))
    around = np.quantile(wrap_180(np.rad2deg(np.arctan2(sine, cosine)) - middle), [TAIL, 1.0 - TAIL])
    if max(abs(around)) > MOST_PHASE_DEG:
        return None
    return Within95(middle, middle + float(around[0]), middle + float(around[1]))


def error_windows(run: ChannelsRun, position_m: FloatArray, start_s: float | None) -> tuple[ErrorWindow, ...]:
    """Return the radial error after some hours: of the flight, and of all its windows.

    Parameters
    ----------
    run : ChannelsRun
    position_m : ndarray, shape (n, 2)
    start_s : float or None
        When navigation began.
    """
    time_s, resets = run.epochs.time_s, np.cumsum(run.epochs.is_reset)
    known = np.flatnonzero(np.isfinite(position_m).all(axis=1)).astype(np.int64)
    if not len(known):
        return ()
    span_s = float(time_s[known[-1]] - time_s[known[0]])
    found = []
    for hours in WINDOW_HOURS:
        length = hours * S_PER_H
        if span_s < length:
            break
        begins = np.arange(time_s[known[0]], time_s[known[-1]] - length + 1e-6, WINDOW_STEP_S)
        first, last = (_nearest(time_s, known, at) for at in (begins, begins + length))
        good = (first >= 0) & (last >= 0)
        good &= resets[first] == resets[last]
        grown = np.hypot(*(position_m[last[good]] - position_m[first[good]]).T)
        since = None
        if start_s is not None:
            at = int(_nearest(time_s, known, np.array([start_s + length]))[0])
            is_clean = at >= 0 and resets[at] == 0
            since = float(np.hypot(*position_m[at])) if is_clean else None
        median, p95 = np.quantile(grown, [0.5, 0.95]).tolist() if len(grown) else (None, None)
        found.append(ErrorWindow(hours, since, median, p95, len(grown), int(span_s // length) if len(grown) else 0))
    return tuple(found)


def _nearest(time_s: FloatArray, known: Int64Array, at_s: FloatArray) -> Int64Array:
    """Return the known rows nearest to some times, -1 where none is within :data:`NEAR_S`."""
    times = time_s[known]
    place = nearest_rows(times, at_s, takes_later=True)
    return np.asarray(np.where(np.abs(times[place] - at_s) <= NEAR_S, known[place], -1), dtype=np.int64)


def _over_time(fit: CauseFit) -> CausesOverTime:
    rows = thinned(len(fit.time_s))
    velocity = fit.measured[rows, 2:]
    parts = {name: (part[rows] @ fit.value) for name, part in fit.parts().items()}
    left = velocity - sum(parts.values(), np.zeros_like(velocity))
    north, east = (
        PartsOfChannel(
            measured_mps=velocity[:, channel],
            schuler_mps=parts["schuler"][:, channel],
            drift_mps=parts["drift"][:, channel],
            azimuth_mps=parts["azimuth"][:, channel],
            body_mps=parts["body"][:, channel],
            reset_mps=parts["reset"][:, channel],
            unexplained_mps=left[:, channel],
        )
        for channel in (0, 1)
    )
    return CausesOverTime(time_s=fit.time_s[rows], north=north, east=east)


def _sentence(
    shares: tuple[CauseShare, ...],
    parameters: tuple[CauseParameter, ...],
    start: Within95,
    tilt: Within95,
    wave: FlightWave | None,
) -> str:
    top = max(shares, key=lambda one: one.share.value)
    share = top.share
    away = taken_away(share.value)
    within = f"{100 * share.low95:.0f} to {100 * share.high95:.0f} %"
    of_it = f"{100 * share.value:.0f} % ({within}{f'; {away}' if away else ''})"
    what = OF_CAUSE.get(top.name, "")
    if top.name == "schuler":
        mrad = 1000.0 * tilt.value / ARCSEC_PER_RAD
        what = (
            f"a Schuler oscillation of {start.value:.2g} m/s from the start, as from a tilt of {mrad:.2g} mrad "
            f"({tilt.value:.0f} arcsec)"
        )
    if share.low95 > HALF:
        head = f"Most of the velocity error, {of_it}, is {what}"
    elif share.value > HALF:
        head = f"Probably most of the velocity error, {of_it}, is {what}"
    else:
        head = f"No cause has half of the velocity error; the largest part, {of_it}, is {what}"
    drifts = [one for one in parameters if one.name.startswith("mean_drift")]
    told = ", ".join(
        f"{one.name.removeprefix('mean_drift_')} {one.value:+.4f} ± {one.half95:.4f} deg/h" for one in drifts
    )
    swings = "" if wave is None else f"; in all {100 * wave.share:.0f} % of the error swings with the Schuler period"
    return f"{head}{swings}; drift {told}" if told else f"{head}{swings}"
