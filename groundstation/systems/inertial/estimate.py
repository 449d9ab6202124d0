"""Estimator of INS errors: from flight tables to states, their basis, and corrected track."""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.base.quantiles import chi_square_quantile
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.methods.ins_noise import InsNoise, choose_class
from groundstation.methods.intervals import slope_through_origin
from groundstation.systems.inertial import figures
from groundstation.systems.inertial.answer import ChannelResult, InertialResult, NavigationStart, StateEstimate
from groundstation.systems.inertial.azimuth import estimate_azimuth
from groundstation.systems.inertial.coupled import CoupledRun
from groundstation.systems.inertial.differences import InsDifferences, differences, only_used
from groundstation.systems.inertial.drift_answer import utc_of
from groundstation.systems.inertial.filter import (
    ChannelsRun,
    DifferenceEpochs,
    SmoothedErrors,
    initial_of,
    run_filter,
    smooth,
)
from groundstation.systems.inertial.kind import kind_of
from groundstation.systems.inertial.model import POSITION, STATES, ChannelModel, FloatArray
from groundstation.systems.inertial.navigation_start import navigation_start, stated_start
from groundstation.systems.inertial.outages import Bridged, bridge_outages
from groundstation.systems.inertial.seams import PATIENCE_S
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.skill import QUANTILES
from groundstation.systems.inertial.tracks import corrected_tracks
from groundstation.tables.gaps import seconds_covered
from groundstation.tables.sources import UNAIDED, said_of
from groundstation.tables.table import Flight, Table

TITLES = {
    "position": "position error",
    "velocity": "velocity error",
    "tilt": "platform tilt",
    "drift": "constant gyro drift",
    "drift_rate": "rate of the drift",
    "random_drift": "random gyro drift",
}
RATE_FROM_S, S_PER_H = 600.0, 3600.0
HALF = 0.5
OUTAGES_LISTED = 5


@dataclass(frozen=True)
class Estimation:
    """Everything system 2 knows of a flight before any forecast is replayed.

    ``corrected_error_m`` (n, 2) is the position error taken off the INS: estimated where GNSS was, forecast by the
    default method where it was not. ``coupled`` is the coupled run, where that forecast needed one.
    """

    compared: InsDifferences
    noise: InsNoise
    run: ChannelsRun
    smoothed: SmoothedErrors
    corrected_error_m: FloatArray
    result: InertialResult
    findings: tuple[Finding, ...]
    coupled: CoupledRun | None = None

    def tracks(self, start_ns: int) -> Iterator[tuple[str, Table]]:
        """Tracks of the INS less its errors (:class:`groundstation.tables.tracks.HasTracks`)."""
        return corrected_tracks(self.compared, self.run, self.smoothed, self.corrected_error_m, start_ns)


def estimate_ins_errors(
    flight: Flight,
    *,
    settings: InertialSettings | None = None,
    aircraft_class: str = "",
    excluded_s: tuple[tuple[float, float], ...] = (),
    nav_start_utc: str = "",
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
    nav_start_utc : str
        Start of navigation, ISO 8601, where the aircraft file states it.

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
    compared = differences(flight, settings=settings, excluded_s=excluded_s)
    return estimate_compared(
        flight,
        compared,
        kind_of(compared, settings),
        settings=settings,
        aircraft_class=aircraft_class,
        nav_start_utc=nav_start_utc,
    )


def estimate_compared(
    flight: Flight,
    compared: InsDifferences,
    kind: tuple[str, str],
    *,
    settings: InertialSettings,
    aircraft_class: str = "",
    nav_start_utc: str = "",
) -> Estimation:
    """Estimate the errors of an INS that is compared with GNSS already.

    ``kind`` and the reason for it are known.
    """
    noise, origin = choose_class(settings.ins_class, aircraft_class, said_of(flight, compared.ins_topic, "ins_class"))
    model = ChannelModel.at(*_mean_place(compared), noise.beta_per_s, settings.transition)
    used = only_used(compared.epochs, settings)
    run = run_filter(used, model, noise, gate=settings.gate_sigmas**2, initial=initial_of(used, noise))
    run = replace(run, epochs=compared.epochs)  # what the filter may not use still judges it
    smoothed, bridged = smooth(run), bridge_outages(flight, compared, run, settings)
    stated = stated_start(nav_start_utc, flight, compared.ins_topic)
    start, unusable = navigation_start(flight, compared, noise.gnss, stated)
    result = _result(flight, compared, run, smoothed, bridged, settings, origin, kind, start)
    findings = (*compared.findings, *unusable, *_findings(compared, run, result))
    return Estimation(compared, noise, run, smoothed, bridged.error_m, result, findings, bridged.coupled)


def _mean_place(compared: InsDifferences) -> tuple[float, float]:
    """Return mean latitude, degrees, and altitude, metres, where the INS knew them.

    Else the equator at sea level.
    """
    places = (compared.latitude_deg, compared.altitude_m)
    latitude, altitude = (
        float(np.mean(values[np.isfinite(values)])) if np.isfinite(values).any() else 0.0 for values in places
    )
    return latitude, altitude


def observability(run: ChannelsRun) -> FloatArray:
    """Return 1 - sigma / sigma without GNSS of every state at every epoch, in [0, 1].

    Shape (n, 6, c).
    """
    blind = np.sqrt(np.einsum("nii->ni", run.covariance_without_data))
    seen = np.stack([run.sigma(channel) for channel in range(run.x.shape[2])], axis=2)
    return np.asarray(np.clip(1.0 - seen / np.maximum(blind, 1e-300)[:, :, None], 0.0, 1.0))


def _result(
    flight: Flight,
    compared: InsDifferences,
    run: ChannelsRun,
    smoothed: SmoothedErrors,
    bridged: Bridged,
    settings: InertialSettings,
    origin: str,
    kind: tuple[str, str],
    start: NavigationStart,
) -> InertialResult:
    visible, epochs = observability(run), run.epochs
    radial, velocity = np.hypot(*run.measured(0).T), run.measured(1)
    rate_50, rate_95, rate_fit = _radial_rates(epochs, radial, start.time_s)
    with_error = np.flatnonzero(np.isfinite(radial))
    ends = with_error[[0, -1]] if len(with_error) else with_error
    largest_s = float(epochs.time_s[np.nanargmax(radial)]) if len(ends) else None
    speed = velocity[np.isfinite(velocity).all(axis=1)]
    return InertialResult(
        ins_topic=compared.ins_topic,
        gnss_topic=compared.gnss_topic,
        ins_class=run.noise.name,
        ins_class_origin=origin,
        kind=kind[0],
        kind_reason=kind[1],
        transition=run.model.transition,
        epochs=int(np.count_nonzero(epochs.has_gnss)),
        gnss_seconds=seconds_covered(epochs.time_s[epochs.has_gnss], settings.outage_s),
        north=_channel(run, visible, 0),
        east=_channel(run, visible, 1),
        radial_error_rate_50_nmiph=rate_50,
        radial_error_rate_95_nmiph=rate_95,
        radial_error_rate_fit_nmiph=rate_fit,
        velocity_error_rms_mps=float(np.sqrt(np.mean(np.sum(speed**2, axis=1)))) if len(speed) else None,
        largest_radial_error_m=float(np.nanmax(radial)) if len(ends) else None,
        largest_radial_error_at_s=largest_s,
        largest_radial_error_utc=utc_of(flight.start_ns if flight.has_utc else None, largest_s),
        navigation_start=start,
        radial_error_first_m=float(radial[ends[0]]) if len(ends) else None,
        radial_error_last_m=float(radial[ends[1]]) if len(ends) else None,
        compared_hours=float(np.ptp(epochs.time_s[ends])) / S_PER_H if len(ends) else None,
        outages=bridged.outages,
        azimuth=estimate_azimuth(compared, run, settings) if kind[0] == UNAIDED else None,
        reopened=run.reopened,
        other_ins=tuple(name for name in topics_of_kind("ins", flight.topics()) if name != compared.ins_topic),
        settings=_flat(settings) | _flat(run.noise, "noise."),
        figures=(
            figures.states_figure(run, smoothed),
            figures.observability_figure(run, visible),
            figures.track_figure(compared, bridged.error_m, smoothed.x[:, POSITION]),
        ),
    )


def _channel(run: ChannelsRun, visible: FloatArray, channel: int) -> ChannelResult:
    seen = np.flatnonzero(run.epochs.has_gnss)
    last = int(seen[-1])
    used = run.used[:, :, channel]
    ratio = np.square(run.innovation[:, :, channel]) / run.innovation_variance[:, :, channel]
    inside = ratio[used != 0]
    count, is_inflated = int((used == 1).sum()), run.noise.gnss.is_inflated
    bounds = [None if is_inflated else float(chi_square_quantile(part, count)) / count for part in (0.025, 0.975)]
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
        share_inside95=float(np.mean(inside <= QUANTILES[95] ** 2)),
        innovations=int((used != 0).sum()),
        rejected=int((used == -1).sum()),
        velocity_error_rms_mps=_rms(run.measured(1)[:, channel]),
        position_error_rms_m=_rms(run.measured(0)[:, channel]),
    )


Rates = tuple[float, float, float] | tuple[None, None, None]


def _radial_rates(epochs: DifferenceEpochs, radial_m: FloatArray, start_s: float | None) -> Rates:
    """Return the radial error rate, nmi/h: median, 95 %, and the fit.

    It is over the time since navigation began or the INS was last reset. Median and 95 % over epochs later than ten
    minutes after it, the fit over all; none where nobody knows when navigation began, or no epoch is so late.
    """
    if start_s is None:
        return None, None, None
    reset_s = np.where(epochs.is_reset, epochs.time_s, -np.inf)
    elapsed_s = epochs.time_s - np.maximum(np.maximum.accumulate(reset_s), start_s)
    known = (elapsed_s >= 0.0) & np.isfinite(radial_m)
    late = known & (elapsed_s > RATE_FROM_S)
    if not late.any():
        return None, None, None
    hours, radial_nmi = elapsed_s / S_PER_H, radial_m / M_PER_NAUTICAL_MILE
    rates = radial_nmi[late] / hours[late]
    fit = slope_through_origin(hours[known], radial_nmi[known], np.ones(int(known.sum())))
    return float(np.median(rates)), float(np.quantile(rates, 0.95)), fit


def _findings(compared: InsDifferences, run: ChannelsRun, result: InertialResult) -> list[Finding]:
    found = []
    rejected = int((run.used == -1).any(axis=2).sum())
    if rejected:
        times = run.epochs.time_s[(run.used == -1).any(axis=(1, 2))]
        text = "GNSS against the estimated INS errors: innovation beyond the gate, not used"
        place = f"{times[0]:.1f} to {times[-1]:.1f} s"
        found.append(Finding("warn", "inertial.outlier", text, compared.gnss_topic, place, rejected))
    if run.reopened:
        text = (
            f"GNSS rejected for more than {PATIENCE_S:.0f} s and then accepted: INS or GNSS jumped undetected, "
            f"or the noise of INS class {result.ins_class} does not fit"
        )
        found.append(Finding("warn", "inertial.reopened", text, compared.gnss_topic, count=run.reopened))
    found += _seam_findings(compared, run)
    if result.other_ins:
        text = f"INS errors are those of {result.ins_topic} only; not used: {', '.join(result.other_ins)}"
        found.append(Finding("info", "inertial.other_ins", text, count=len(result.other_ins)))
    return [*found, *_outage_findings(compared, result)]


def _seam_findings(compared: InsDifferences, run: ChannelsRun) -> list[Finding]:
    """Return a finding for each outage at whose end GNSS was beyond the gate and used.

    One stands for all where many are.
    """
    time_s, found = run.epochs.time_s, []
    says = "agrees with itself but not with the forecast: used, sigma through the outage times"
    if len(run.seams) > OUTAGES_LISTED:
        worst = max(run.seams, key=lambda seam: seam.factor)
        text = f"GNSS after {len(run.seams)} outages {says} up to {worst.factor:.1f}"
        place = f"largest at {time_s[worst.back]:.1f} s"
        return [Finding("warn", "inertial.seam", text, compared.gnss_topic, place, len(run.seams))]
    for seam in run.seams:
        length_s = time_s[seam.first] - time_s[seam.last]
        text = f"GNSS after {length_s:.0f} s without it {says} {seam.factor:.1f}"
        found.append(Finding("warn", "inertial.seam", text, compared.gnss_topic, f"at {time_s[seam.back]:.1f} s"))
    return found


def _outage_findings(compared: InsDifferences, result: InertialResult) -> list[Finding]:
    """One finding for each outage, or one for all where there are many."""
    lost = {"gnss": "no GNSS", "ins": "no INS", "both": "neither INS nor GNSS"}
    if len(result.outages) > OUTAGES_LISTED:
        longest = max(result.outages, key=lambda outage: outage.length_s)
        text = f"INS or GNSS missing in {len(result.outages)} intervals, the longest {longest.length_s:.0f} s"
        place = f"longest from {longest.start_s:.1f} s"
        return [Finding("info", "inertial.outage", text, compared.gnss_topic, place, len(result.outages))]
    found = []
    for outage in result.outages:
        after = "the forecast through it could not be checked"
        if outage.jump_m is not None:
            claimed = "" if outage.sigma_m is None else f" (claimed {outage.sigma_m:.0f} m)"
            after = f"the forecast was {outage.jump_m:.0f} m off at its end{claimed}"
        text = f"{lost[outage.missing]} for {outage.length_s:.0f} s: {after}"
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
