"""The estimator of INS errors: from the tables of a flight to states, what they rest on, and the corrected track."""

from dataclasses import dataclass, fields, is_dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from groundstation.base.findings import Finding
from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.estimators.inertial import figures
from groundstation.estimators.inertial.azimuth import estimate_azimuth
from groundstation.estimators.inertial.coupled import hindcast_coupled, run_coupled
from groundstation.estimators.inertial.differences import Differences, differences
from groundstation.estimators.inertial.filter import PATIENCE_S, FilterRun, Smoothed, run_filter, smooth
from groundstation.estimators.inertial.hindcast import hindcast, leads_of
from groundstation.estimators.inertial.model import POSITION, STATES, ChannelModel, FloatArray
from groundstation.estimators.inertial.noise import InsNoise, choose_class
from groundstation.estimators.inertial.settings import InertialSettings
from groundstation.estimators.inertial.start_covariance import covariance_without_data
from groundstation.results.inertial import AzimuthEstimate, ChannelResult, InertialResult, RealOutage, StateEstimate
from groundstation.tables.gaps import largest_step_s
from groundstation.tables.table import Flight

TITLES = {
    "position": "position error",
    "velocity": "velocity error",
    "tilt": "platform tilt",
    "drift": "constant gyro drift",
    "drift_rate": "rate of the drift",
    "random_drift": "random gyro drift",
}
MINUTE_S, RATE_FROM_S = 60.0, 600.0
HALF, BOUND95 = 0.5, 1.959963984540054
UNAIDED, AIDED = "unaided", "gnss_aided"


@dataclass(frozen=True)
class Estimation:
    """Everything system 2 knows of a flight before any forecast is replayed.

    ``corrected_error_m`` (n, 2) is the position error taken off the INS: estimated where GNSS was, forecast by the
    default method where it was not.
    """

    compared: Differences
    noise: InsNoise
    run: FilterRun
    smoothed: Smoothed
    corrected_error_m: FloatArray
    result: InertialResult
    findings: tuple[Finding, ...]


def estimate_ins_errors(
    flight: Flight,
    *,
    settings: InertialSettings | None = None,
    aircraft_class: str = "",
    excluded_s: tuple[tuple[float, float], ...] = (),
) -> Estimation:
    """Estimate the errors of the INS in both horizontal channels.

    Parameters
    ----------
    flight : Flight
        Topics ``ins`` and ``gnss`` with positions; velocities are used where both have them.
    settings : InertialSettings, optional
    aircraft_class : str
        INS class the aircraft file names.
    excluded_s : tuple of (float, float)
        Flight seconds in which GNSS is not used.

    Raises
    ------
    NotAssessableError
        With the reason: no INS or GNSS position, too little of both together.
    SettingsError
        For an INS class that does not exist.

    Notes
    -----
    Two channels of six states (Neusypin et al., 2003). Position errors are metres on the sphere, so the model is driven
    with the known drag of meridians that converge; INS resets open the position and velocity again.
    """
    settings = settings or InertialSettings()
    noise, origin = choose_class(settings, aircraft_class, flight.metadata.get("ins_class", ""))
    compared = differences(flight, settings=settings, excluded_s=excluded_s)
    model = ChannelModel.at(
        float(np.nanmean(compared.latitude_deg)),
        float(np.nanmean(compared.altitude_m)),
        noise.beta_per_s,
        settings.transition,
    )
    run = run_filter(compared.epochs, model, noise, gate=settings.gate_sigmas**2)
    smoothed = smooth(run)
    kind, kind_reason = kind_of(compared, settings)
    outages = real_outages(run, settings)
    corrected = _corrected(compared, run, outages, settings)
    azimuth = estimate_azimuth(compared, run, settings) if kind == UNAIDED else None
    result = _result(compared, run, smoothed, settings, noise, origin, (kind, kind_reason), outages, corrected, azimuth)
    return Estimation(
        compared, noise, run, smoothed, corrected, result, (*compared.findings, *_findings(compared, run, result))
    )


def kind_of(compared: Differences, settings: InertialSettings) -> tuple[str, str]:
    """Whether the INS is corrected by GNSS already: its own mode says so, or it never drifts; and the reason."""
    if compared.aided_share > HALF:
        return AIDED, "its own mode says that GNSS corrects it"
    epochs = compared.epochs
    known = np.isfinite(epochs.position_m).all(axis=1)
    minute = np.floor(epochs.time_s[known] / MINUTE_S).astype(np.int64)
    _, which, count = np.unique(minute, return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(which, epochs.position_m[known, axis]) / count for axis in range(2)], axis=1)
    spread = means - np.median(means, axis=0)
    largest = float(np.quantile(np.hypot(*spread.T), 0.95)) if len(means) else 0.0
    if largest < settings.aided_radial_m:
        minutes = float(np.ptp(epochs.time_s[known])) / MINUTE_S
        return AIDED, (
            f"it stays within {largest:.1f} m of GNSS for {minutes:.0f} min (95 % of the minute means), "
            "as no unaided INS does"
        )
    return UNAIDED, f"it drifts from GNSS: minute means spread over {largest:.0f} m (95 %)"


def real_outages(run: FilterRun, settings: InertialSettings) -> tuple[RealOutage, ...]:
    """Intervals without GNSS in the log itself, and how the forecast through each came out."""
    epochs, found = run.epochs, []
    seen = np.flatnonzero(np.isfinite(epochs.position_m).any(axis=1))
    limit = max(settings.outage_s, largest_step_s((epochs.time_s[seen] * 1e9).astype(np.int64)))
    for last, back in pairwise(seen):
        length = float(epochs.time_s[back] - epochs.time_s[last])
        if length > limit:
            jump = float(np.hypot(*run.innovation[back, 0]))
            sigma = float(np.sqrt(np.sum(run.innovation_variance[back, 0])))
            found.append(RealOutage(float(epochs.time_s[last]), float(epochs.time_s[back]), length, jump, sigma))
    if len(seen) and epochs.time_s[-1] - epochs.time_s[seen[-1]] > limit:
        begin, end = float(epochs.time_s[seen[-1]]), float(epochs.time_s[-1])
        found.append(RealOutage(begin, end, end - begin, None, None))
    return tuple(found)


def _corrected(
    compared: Differences, run: FilterRun, outages: tuple[RealOutage, ...], settings: InertialSettings
) -> FloatArray:
    """Position error to take off: the filter's, and through outages the default method's forecast."""
    out = np.array(run.x[:, POSITION])
    time_s = run.epochs.time_s
    is_coupled = settings.model == "coupled" and settings.default_method == "last_estimate"
    if settings.default_method == "last_estimate" and not is_coupled:
        return out
    coupled = run_coupled(compared, run.noise, settings) if is_coupled else None
    for outage in outages:
        start = int(np.searchsorted(time_s, outage.start_s))
        inside = np.flatnonzero((time_s > outage.start_s) & (time_s < outage.end_s))
        if not inside.size:
            continue
        step = settings.forecast_step_s
        lead_s = leads_of(step, outage.length_s)
        at = np.array([start])
        if coupled is not None:
            built = hindcast_coupled(coupled, at, lead_s, settings)[0]
        else:
            grown = hindcast(run, at, lead_s, (settings.default_method,), settings)
            built = grown.forecast_m[settings.default_method][0]
        for axis in range(out.shape[1]):
            grown_m = np.interp(time_s[inside] - outage.start_s, np.r_[0.0, lead_s], np.r_[0.0, built[:, axis]])
            out[inside, axis] = run.x[start, POSITION, axis] + grown_m
    return out


def observability(run: FilterRun) -> FloatArray:
    """1 - sigma / sigma without GNSS of every state at every epoch, shape (n, 6, c), in [0, 1]."""
    blind = np.sqrt(np.einsum("nii->ni", covariance_without_data(run)))
    seen = np.stack([run.sigma(channel) for channel in range(run.x.shape[2])], axis=2)
    return np.asarray(np.clip(1.0 - seen / np.maximum(blind, 1e-300)[:, :, None], 0.0, 1.0))


def _result(
    compared: Differences,
    run: FilterRun,
    smoothed: Smoothed,
    settings: InertialSettings,
    noise: InsNoise,
    origin: str,
    kind: tuple[str, str],
    outages: tuple[RealOutage, ...],
    corrected: FloatArray,
    azimuth: AzimuthEstimate | None,
) -> InertialResult:
    visible = observability(run)
    epochs = run.epochs
    radial = np.hypot(*epochs.position_m.T)
    rate_50, rate_95 = _radial_rates(epochs.time_s, radial)
    velocity = epochs.velocity_mps[np.isfinite(epochs.velocity_mps).all(axis=1)]
    return InertialResult(
        ins_topic=compared.ins_topic,
        gnss_topic=compared.gnss_topic,
        ins_class=noise.name,
        ins_class_origin=origin,
        kind=kind[0],
        kind_reason=kind[1],
        transition=run.model.transition,
        epochs=len(epochs),
        gnss_seconds=float(epochs.has_gnss.sum()) * settings.epoch_interval_s,
        channels=tuple(_channel(run, visible, channel) for channel in range(len(figures.CHANNELS))),
        radial_error_rate_50_nmiph=rate_50,
        radial_error_rate_95_nmiph=rate_95,
        velocity_error_rms_mps=float(np.sqrt(np.mean(np.sum(velocity**2, axis=1)))) if len(velocity) else None,
        largest_radial_error_m=float(np.nanmax(radial)) if np.isfinite(radial).any() else None,
        outages=outages,
        azimuth=azimuth,
        settings=_flat(settings) | _flat(noise, "noise."),
        figures=(
            figures.states_figure(run, smoothed),
            figures.observability_figure(run, visible),
            figures.track_figure(compared, corrected, smoothed.x[:, POSITION], run),
        ),
    )


def _channel(run: FilterRun, visible: FloatArray, channel: int) -> ChannelResult:
    from scipy.stats import chi2

    seen = np.flatnonzero(run.epochs.has_gnss)
    last = int(seen[-1])
    used = run.used[:, :, channel]
    ratio = np.square(run.innovation[:, :, channel]) / run.innovation_variance[:, :, channel]
    inside = ratio[used != 0]
    count, is_inflated = int((used == 1).sum()), run.noise.gnss.is_inflated
    bounds = [None if is_inflated else float(chi2.ppf(part, count) / count) for part in (0.025, 0.975)]
    time_s, states = run.epochs.time_s, []
    for index, name in enumerate(STATES):
        _, unit, factor = figures.SHOWN[index]
        below = np.flatnonzero(visible[: last + 1, index, channel] < HALF)
        from_row = int(below[-1]) + 1 if below.size else 0
        states.append(
            StateEstimate(
                name,
                TITLES[name],
                unit,
                value=float(factor * run.x[last, index, channel]),
                sigma=float(factor * run.sigma(channel)[last, index]),
                observability=float(visible[last, index, channel]),
                observable_from_s=float(time_s[from_row]) if from_row <= last else None,
            )
        )
    return ChannelResult(
        figures.CHANNELS[channel],
        tuple(states),
        nis=float(np.mean(ratio[used == 1])),
        nis_low=bounds[0],
        nis_high=bounds[1],
        share_inside95=float(np.mean(inside <= BOUND95**2)),
        innovations=int((used != 0).sum()),
        rejected=int((used == -1).sum()),
        velocity_error_rms_mps=_rms(run.epochs.velocity_mps[:, channel]),
        position_error_rms_m=_rms(run.epochs.position_m[:, channel]),
    )


def _radial_rates(time_s: FloatArray, radial_m: FloatArray) -> tuple[float | None, float | None]:
    """Radial error over the time since the first epoch, nmi/h: median and 95 % over epochs later than ten minutes."""
    elapsed = time_s - time_s[0]
    late = (elapsed > RATE_FROM_S) & np.isfinite(radial_m)
    if not late.any():
        return None, None
    rates = radial_m[late] / M_PER_NAUTICAL_MILE / (elapsed[late] / 3600.0)
    return float(np.median(rates)), float(np.quantile(rates, 0.95))


def _findings(compared: Differences, run: FilterRun, result: InertialResult) -> list[Finding]:
    if result.kind == AIDED:  # the model is of an INS that is left alone: what it says of this one is not told
        text = f"this INS is corrected by GNSS already ({result.kind_reason}): a forecast from it means nothing"
        return [Finding("info", "inertial.gnss_aided", text, compared.ins_topic)]
    found = []
    rejected = int((run.used == -1).any(axis=2).sum())
    if rejected:
        times = run.epochs.time_s[(run.used == -1).any(axis=(1, 2))]
        text = "GNSS against the estimated INS errors: innovation beyond the gate, not used"
        place = f"{times[0]:.1f} to {times[-1]:.1f} s"
        found.append(Finding("warn", "inertial.outlier", text, compared.gnss_topic, place, rejected))
    if run.reopened:
        text = (
            f"GNSS rejected for more than {PATIENCE_S:.0f} s and then believed after all: the noise of INS class "
            f"{result.ins_class} does not fit this INS or this receiver"
        )
        found.append(Finding("warn", "inertial.reopened", text, compared.gnss_topic, count=run.reopened))
    for outage in result.outages:
        after = "GNSS did not come back"
        if outage.jump_m is not None:
            after = f"the forecast was {outage.jump_m:.0f} m off when it came back (claimed {outage.sigma_m:.0f} m)"
        text = f"no GNSS for {outage.length_s:.0f} s: {after}"
        found.append(Finding("info", "inertial.outage", text, compared.gnss_topic, f"from {outage.start_s:.1f} s"))
    return found


def _rms(values: FloatArray) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else None


def _flat(settings: Any, before: str = "") -> dict[str, float | str | bool]:
    """Every number of a settings dataclass under its dotted name."""
    out: dict[str, float | str | bool] = {}
    for item in fields(settings):
        value = getattr(settings, item.name)
        if is_dataclass(value):
            out |= _flat(value, f"{before}{item.name}.")
        elif isinstance(value, tuple):
            out[f"{before}{item.name}"] = ", ".join(f"{part:g}" for part in value)
        else:
            out[f"{before}{item.name}"] = value
    return out
