"""References of the estimate: parking heading, runway bearing, the aircraft's own figures."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import mean_heading, unwrap, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.methods.ins_noise import class_names, load_class
from groundstation.methods.intervals import effective_samples
from groundstation.methods.taxi.samples import TaxiSamples
from groundstation.systems.heading.answer import HeadingResult, OnboardComparison, RunwayCheck
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.known import SiteData
from groundstation.tables.table import Flight

FloatArray = NDArray[np.float64]
DRIFT_LEAST_DEG_PER_H, DRIFT_UNKNOWN_DEG_PER_H = 0.1, 5.0  # sigma of the azimuth drift: least, and of an unknown INS
CLASS_SIGMAS = 3.0
HELD_SHARE = 0.3  # of that sigma, by which the drift in motion may differ from that at standstill
LEAST_STANDING, STANDING_DEG = 20, 0.01  # samples; what people aboard and wind may turn an aircraft that stands
S_PER_H = 3600.0
RUNWAY_ALONG_DEG = 10.0
REFERENCE_KEY = "reference.parking_heading_deg"
REFERENCE_SIGMA_KEY = "reference.parking_heading_sigma_deg"
REFERENCE_SIGMA_DEG = 0.05  # of a reference in the log without a sigma, as of a stand's
CONFLICT_SIGMAS = 3.0
CONFLICT_SIGMA_LEAST_DEG = 0.05
ABSURD_RESIDUAL_DEG = 5.0


@dataclass(frozen=True)
class ParkedHeading:
    """True heading of the aircraft as parked, [0, 360), its sigma, and who says so."""

    heading_deg: float
    sigma_deg: float
    origin: str


@dataclass(frozen=True)
class Parking:
    """Heading at the last standstill, as shown and corrected, and its reference.

    None where not known.
    """

    ins_heading_deg: float | None = None
    heading_deg: float | None = None
    sigma_deg: float | None = None
    reference_deg: float | None = None
    residual_arcmin: float | None = None


def drift_prior(ins_class: str, logged_class: str) -> float:
    """Return the sigma of the azimuth drift of an INS, deg/h.

    It is three times the gyro drift of its class, at least 0.1. The class is that of the aircraft file, else the log's
    where it is a shipped one; an INS of no known class may be a tactical one.

    Examples
    --------
    >>> drift_prior("navigation", ""), drift_prior("", "")
    (0.1, 5.0)
    """
    name = ins_class or (logged_class.lower() if logged_class.lower() in class_names() else "")
    return max(CLASS_SIGMAS * load_class(name).drift_dph, DRIFT_LEAST_DEG_PER_H) if name else DRIFT_UNKNOWN_DEG_PER_H


def standstill_drift(time_s: FloatArray, heading_deg: FloatArray) -> tuple[float, float] | None:
    """Return the slope of the INS heading while the aircraft stands, deg/h, and its sigma.

    None where the INS holds its heading.
    """
    known = np.isfinite(heading_deg)
    time_s, heading = time_s[known], unwrap(heading_deg[known])
    span_s = float(np.ptp(time_s)) if len(time_s) > LEAST_STANDING else 0.0
    if span_s <= 0.0 or float(np.ptp(heading)) == 0.0:
        return None
    centred = time_s - np.mean(time_s)
    slope = float(centred @ heading / (centred @ centred))
    left = heading - np.mean(heading) - slope * centred
    error = float(np.std(left)) * np.sqrt(len(left) / effective_samples(left) / (centred @ centred))
    return slope * S_PER_H, float(np.hypot(error, STANDING_DEG / span_s)) * S_PER_H


def shrunk_drift(prior_sigma_deg_per_h: float, *measured: tuple[float, float] | None) -> tuple[float, float]:
    """Drift and sigma, deg/h: 0 +- the prior of the INS, weighed with what was measured.

    Examples
    --------
    >>> drift, sigma = shrunk_drift(0.1, (20.0, 10.0), None)
    >>> round(drift, 4), round(sigma, 4)
    (0.002, 0.1)
    """
    known = [(drift, 1.0 / sigma**2) for drift, sigma in (one for one in measured if one) if sigma > 0.0]
    weight = 1.0 / prior_sigma_deg_per_h**2 + sum(part for _drift, part in known)
    return sum(drift * part for drift, part in known) / weight, float(weight**-0.5)


def lasting_drift(
    standing: tuple[float, float] | None, on_taxi: tuple[float, float] | None, prior_sigma_deg_per_h: float
) -> tuple[float, float] | None:
    """Return the slope at standstill where it may be that of the whole time, else None.

    An INS that settles, or that two antennas correct, turns as it stands and stops to. Its slope there differs from
    that on taxi, or where that is not known from 0 +- the prior, by more than three sigma. The sigma returned allows
    for a drift in motion that is another by a share of the prior.

    Examples
    --------
    >>> lasting_drift((43.5, 3.0), (-0.4, 0.8), 5.0) is None, lasting_drift((43.5, 3.0), (40.0, 30.0), 5.0) is None
    (True, False)
    """
    if standing is None:
        return None
    sigma = float(np.hypot(standing[1], HELD_SHARE * prior_sigma_deg_per_h))
    expected, expected_sigma = on_taxi or (0.0, prior_sigma_deg_per_h)
    is_apart = abs(standing[0] - expected) > CONFLICT_SIGMAS * float(np.hypot(sigma, expected_sigma))
    return None if is_apart else (standing[0], sigma)


def site_reference(site: SiteData) -> ParkedHeading | None:
    """Reference of the stand that the user's site file names."""
    stand = site.parked_on()
    if stand is None:
        return None
    return ParkedHeading(float(wrap_360(stand.heading_deg)), stand.sigma_deg, f"site file, stand {stand.name}")


def logged_reference(flight_metadata: Mapping[str, str]) -> ParkedHeading | None:
    """Reference that the log itself brings; None without one, or where it is no finite number.

    Examples
    --------
    >>> logged_reference({"reference.parking_heading_deg": "-10", "reference.parking_heading_sigma_deg": "0.02"})
    ParkedHeading(heading_deg=350.0, sigma_deg=0.02, origin='log')
    >>> logged_reference({"reference.parking_heading_deg": "nan"}) is None
    True
    """
    heading = _finite(flight_metadata.get(REFERENCE_KEY))
    if heading is None:
        return None
    sigma = _finite(flight_metadata.get(REFERENCE_SIGMA_KEY))
    return ParkedHeading(float(wrap_360(heading)), sigma if sigma and sigma > 0.0 else REFERENCE_SIGMA_DEG, "log")


def _finite(text: str | None) -> float | None:
    try:
        value = float(text) if text else math.nan
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def parking_reference(flight_metadata: Mapping[str, str], site: SiteData) -> ParkedHeading | None:
    """The reference compared with: the user's site file stands above the log."""
    return site_reference(site) or logged_reference(flight_metadata)


def reference_conflict(flight_metadata: Mapping[str, str], site: SiteData) -> str | None:
    """Return one line where site file and log disagree.

    They do by more than three of their combined sigma (at least 0.05 deg).

    Examples
    --------
    >>> from groundstation.systems.known import Stand
    >>> reference_conflict({"reference.parking_heading_deg": "311"}, SiteData((Stand("7", 310.0),)))
    'references of the parking heading disagree: 310.00 deg (site file, stand 7), 311.00 deg (log); the former is used'
    """
    of_site, of_log = site_reference(site), logged_reference(flight_metadata)
    if of_site is None or of_log is None:
        return None
    sigma = max(math.hypot(of_site.sigma_deg, of_log.sigma_deg), CONFLICT_SIGMA_LEAST_DEG)
    if abs(float(wrap_180(of_log.heading_deg - of_site.heading_deg))) <= CONFLICT_SIGMAS * sigma:
        return None
    return (
        f"references of the parking heading disagree: {of_site.heading_deg:.2f} deg ({of_site.origin}), "
        f"{of_log.heading_deg:.2f} deg (log); the former is used"
    )


def reference_findings(result: HeadingResult, flight_metadata: Mapping[str, str], site: SiteData) -> tuple[str, ...]:
    """Return warnings on references that disagree or are too far from the estimate.

    The latter are unlikely to be the right ones.
    """
    conflict = reference_conflict(flight_metadata, site)
    lines = [conflict] if conflict else []
    used, residual = parking_reference(flight_metadata, site), result.reference_residual_arcmin
    if used and residual is not None and abs(residual) > ABSURD_RESIDUAL_DEG * ARCMIN_PER_DEG:
        lines.append(
            f"corrected parking heading is {residual / ARCMIN_PER_DEG:+.1f} deg from its reference of "
            f"{used.heading_deg:.2f} deg ({used.origin}): check the stand and the reference"
        )
    return tuple(lines)


def parking_heading(
    samples: TaxiSamples,
    in_interval: NDArray[np.bool_],
    flight: Flight,
    site: SiteData,
    error: tuple[float, float, float],
    drift: tuple[float | None, float | None],
    drift_prior_deg_per_h: float,
) -> Parking:
    """Heading of the aircraft at the last standstill, corrected.

    heading = INS heading there - (error - drift x (t_taxi - t_parking)), because the error at parking was smaller than
    the error on taxi by what it drifted in between. The drift is that of :func:`shrunk_drift`, from the slope on taxi
    and from that at standstill where that lasts (:func:`lasting_drift`). Where it does not, the spread of the heading
    there is in the sigma.

    Parameters
    ----------
    error : (error_deg, sigma_deg, t_taxi_s)
    drift : (drift, sigma), deg/h
        On taxi.
    drift_prior_deg_per_h : float
    """
    known = parking_reference(flight.metadata, site)
    reference = known.heading_deg if known else None
    if not in_interval.any() or not np.isfinite(samples.heading_deg[in_interval]).any():
        return Parking(reference_deg=reference)
    shown = mean_heading(samples.heading_deg[in_interval])
    turning = standstill_drift(samples.time_s[in_interval], samples.heading_deg[in_interval])
    on_taxi = None if drift[0] is None or drift[1] is None else (drift[0], drift[1])
    standing = lasting_drift(turning, on_taxi, drift_prior_deg_per_h)
    rate, rate_sigma = shrunk_drift(drift_prior_deg_per_h, on_taxi, standing)
    moved = turning is not None and standing is None
    spread = float(np.nanstd(wrap_180(samples.heading_deg[in_interval] - shown))) if moved else 0.0
    hours = (error[2] - float(np.mean(samples.time_s[in_interval]))) / 3600.0
    corrected = float(wrap_360(shown - (error[0] - rate * hours)))
    residual = None if reference is None else float(wrap_180(corrected - reference)) * ARCMIN_PER_DEG
    sigma = float(np.sqrt(error[1] ** 2 + (rate_sigma * hours) ** 2 + spread**2))
    return Parking(shown, corrected, sigma, reference, residual)


def runway_checks(
    samples: TaxiSamples, site: SiteData, error_deg: float, sigma_deg: float, settings: HeadingSettings
) -> tuple[RunwayCheck, ...]:
    """Compare the INS heading on the take-off run with the true bearing of the runway.

    It is a second, independent reference. The run is the part of the ground samples faster than taxi with the heading
    steady. The runway is the one whose bearing is nearest the corrected heading, within 10 deg. Crosswind and the
    pilot's feet enter its sigma only as far as they show in the heading.
    """
    with np.errstate(invalid="ignore"):
        run = (samples.speed_mps > settings.taxi_speed_max_mps) & (
            np.abs(samples.rate_dps) <= settings.turn_rate_max_dps
        )
    run &= np.isfinite(samples.heading_deg) & ~np.isin(samples.gate, ["airborne", "not proven ground"])
    if run.sum() < 3 or not site.runways:
        return ()
    heading = mean_heading(samples.heading_deg[run])
    away = [abs(float(wrap_180(heading - error_deg - runway.true_bearing_deg))) for runway in site.runways]
    if min(away) > RUNWAY_ALONG_DEG:
        return ()
    runway = site.runways[int(np.argmin(away))]
    spread = wrap_180(samples.heading_deg[run] - heading)
    own = float(np.std(spread)) / np.sqrt(effective_samples(spread))
    error = float(wrap_180(heading - runway.true_bearing_deg))
    sigma = float(np.hypot(own, runway.sigma_deg))
    return (
        RunwayCheck(runway.name, runway.true_bearing_deg, heading, error, sigma, float(wrap_180(error - error_deg))),
    )


def onboard_comparison(flight: Flight, end_s: float, error_deg: float) -> OnboardComparison | None:
    """The last figures the aircraft computed itself before lift-off, beside ours."""
    for topic in topics_of_kind("onboard", flight.topics()):
        table = flight[topic]
        before = flight.seconds(table.time_ns) <= end_s + 60.0

        def last(name: str) -> float | None:
            known = table.values(name)[before]  # noqa: B023 - called in this turn of the loop only
            known = known[np.isfinite(known)]
            return float(known[-1]) if len(known) else None

        status = [text for text in table.text("status")[before] if text]
        error = last("heading_error_deg")
        return OnboardComparison(
            heading_error_deg=error,
            precision_deg=last("precision_deg"),
            quality_deg=last("quality_deg"),
            cycles=last("cycles"),
            correction_entered_deg=last("correction_entered_deg"),
            status=str(status[-1]) if status else "",
            difference_error_deg=None if error is None else float(wrap_180(error - error_deg)),
        )
    return None


def mode_changes(flight: Flight, ins_topic: str, start_s: float, end_s: float) -> int | None:
    """Changes of the INS mode between two flight times; None where the mode is not logged."""
    table = flight[ins_topic]
    mode = table.text("mode")
    inside = (flight.seconds(table.time_ns) >= start_s) & (flight.seconds(table.time_ns) <= end_s) & (mode != "")
    known = mode[inside]
    return int(np.sum(known[1:] != known[:-1])) if len(known) else None
