"""Statistics from the table of flights: by aircraft, outliers, calibration."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.quantiles import normal_below
from groundstation.methods.fleet.aircraft import mean_over_flights
from groundstation.methods.fleet.changes import ChangeSettings
from groundstation.methods.fleet.moments import Moments, merged, moments_of
from groundstation.methods.fleet.outliers import FALSE_OUTLIERS, FEWEST, find_outliers
from groundstation.methods.fleet.trends import groups_of, scaled, unscaled
from groundstation.methods.intervals import share_interval
from groundstation.results.arrays.fleet import FleetChecks
from groundstation.results.figures import FigureData
from groundstation.results.fleet import (
    WHOLE_FLEET,
    AircraftRow,
    FittedNormal,
    FleetCalibration,
    OutlierRow,
)

FloatArray = NDArray[np.float64]
PIT_BINS = 10

LOOKED_AT: Mapping[str, str] = {
    "error_deg": "heading error, deg",
    "standard_error_deg": "standard error of the heading error, deg",
    "estimate_sd_deg": "spread of the differences, deg",
    "onboard_difference_deg": "onboard heading error - ours, deg",
    "reference_residual_arcmin": "parking heading - reference, arcmin",
    "radial_error_rate_fit_nmiph": "INS radial error rate, nmi/h",
    "forecast_60min_rms_m": "forecast error after 60 min, m",
    "health_vibration_mps2": "vibration in the air, m/s2",
    "health_hdop": "HDOP in the air",
    "health_test_ratio": "largest innovation test ratio",
    "onboard_heading_rms_deg": "heading error of the on-board filter, RMS, deg",
    "onboard_tilt_rms_deg": "tilt error of the on-board filter, RMS, deg",
}
CHECKS: Mapping[str, str] = {
    "reference": "corrected parking heading against its reference",
    "runway": "INS heading less its error against the runway",
    "onboard": "heading error found on board against ours",
    "truth_heading": "heading error found against the reference beside the log",
    "truth_gnss": "GNSS position against it",
    "truth_ins": "INS position against it",
    "truth_corrected": "INS less its estimated errors against it",
    "truth_smoothed": "INS less its smoothed errors against it",
    "truth_trajectory": "best trajectory against it",
}


def stated_rates(settings: ChangeSettings) -> dict[str, float]:
    """The rates and limits that the statistics keep to, by name."""
    return {
        "confidence": 0.95,
        "false_change_per_aircraft": settings.false_change,
        "outside_limits_per_flight": settings.false_alarm,
        "any_false_outlier_in_the_fleet": FALSE_OUTLIERS,
        "fewest_flights_for_a_trend": settings.fewest,
        "fewest_flights_for_outliers": FEWEST,
    }


def normals_of(aircraft: Sequence[str], moments: Sequence[Moments]) -> tuple[FittedNormal, ...]:
    """Normals fitted to the samples of the whole fleet and of each named aircraft."""
    parts: dict[str, list[Moments]] = {name: [] for name in sorted({*aircraft}) if name}
    for name, one in zip(aircraft, moments, strict=True):
        if name:
            parts[name].append(one)
    groups = {WHOLE_FLEET: list(moments)} | parts
    pooled = [(name, len(group), merged(group)) for name, group in groups.items()]
    return tuple(
        FittedNormal(name, flights, total.count, total.mean, total.sigma)
        for name, flights, total in pooled
        if total.count > 1
    )


def by_aircraft(flights: FigureData) -> tuple[AircraftRow, ...]:
    """Heading error of the whole fleet and of each named aircraft."""
    groups = groups_of(flights)
    everything = np.arange(len(flights))
    rows = [_aircraft_row(WHOLE_FLEET, flights, everything)] if len(flights) else []
    rows += [_aircraft_row(name, flights, own) for name, own in groups.items()]
    return tuple(rows)


def _aircraft_row(name: str, flights: FigureData, rows: NDArray[np.intp]) -> AircraftRow:
    """Return the statistics of an aircraft's flights without those with the verdict reject."""
    kept = rows[flights["verdict"][rows] != "reject"]
    error = flights["error_deg"][kept]
    over = mean_over_flights(error, flights["standard_error_deg"][kept])
    has_interval = over is not None and over.flights > 1
    is_one = len(np.unique(flights["aircraft"][rows])) == 1
    sampled = kept[np.isfinite(flights["sample_m2_deg2"][kept])]
    columns = (flights[key][sampled].tolist() for key in ("samples", "sample_mean_deg", "sample_m2_deg2"))
    parts = [Moments(int(count), mean, m2) for count, mean, m2 in zip(*columns, strict=True)]
    pooled, within = merged(parts), sum(part.m2 for part in parts)
    freedom = pooled.count - len(parts)
    return AircraftRow(
        aircraft=name,
        flights=len(rows),
        assessed=int(np.isfinite(flights["error_deg"][rows]).sum()),
        averaged=int(np.isfinite(error).sum()),
        accepted=int(np.sum(flights["verdict"][rows] == "accept")),
        samples=pooled.count,
        mean_deg=None if over is None else over.mean,
        confidence95_deg=(over.low, over.high) if over is not None and has_interval and is_one else None,
        sample_mean_deg=pooled.mean if parts else None,
        sigma_within_deg=math.sqrt(within / freedom) if freedom > 0 else None,
        sigma_between_deg=over.sigma_between if over is not None and has_interval else None,
        heterogeneity=over.heterogeneity if over is not None and has_interval else None,
    )


def outliers(flights: FigureData) -> tuple[OutlierRow, ...]:
    """Find flights with a figure far from those of the same aircraft, by flight id.

    It is one test over the whole fleet.
    """
    aircraft = groups_of(flights)
    keys = [(quantity, name) for quantity in LOOKED_AT for name in aircraft]
    groups = {"\n".join(key): scaled(key[0], flights[key[0]][aircraft[key[1]]]) for key in keys}
    found = []
    for one in find_outliers(groups):
        quantity, name = one.group.split("\n", 1)
        row = aircraft[name][one.index]
        value, typical = float(flights[quantity][row]), float(unscaled(quantity, np.asarray(one.typical)))
        reason = (
            f"{LOOKED_AT[quantity]}: {value:.4g}, usual for this aircraft {typical:.4g} ({one.z:+.1f} robust sigma)"
        )
        flight_id = str(flights["flight_id"][row])
        found.append(OutlierRow(flight_id, name, quantity, value, typical, one.z, reason))
    return tuple(sorted(found, key=lambda one: (one.flight_id, list(LOOKED_AT).index(one.quantity))))


def calibrations(checks: FleetChecks) -> tuple[FleetCalibration, ...]:
    """Judge each kind of check, flights with the verdict reject left out."""
    found = []
    for quantity, title in CHECKS.items():
        own = (checks.quantity == quantity) & (checks.verdict != "reject")
        found.append(calibrate(quantity, title, checks.z[own], checks.is_inside[own]))
    return tuple(one for one in found if one is not None)


def calibrate(quantity: str, title: str, z: FloatArray, is_inside: NDArray[np.bool_]) -> FleetCalibration | None:
    """Judge the sigmas of one kind of check.

    Parameters
    ----------
    quantity, title : str
    z : ndarray, shape (n,)
        Residual / sigma of each check, finite.
    is_inside : ndarray of bool, shape (n,)
        Whether the residual was inside the stated 95 % interval.

    Returns
    -------
    FleetCalibration or None
        None without checks.
    """
    if not len(z):
        return None
    found = moments_of(z)
    place = np.minimum((normal_below(z) * PIT_BINS).astype(np.int64), PIT_BINS - 1)
    inside = int(np.sum(is_inside))
    return FleetCalibration(
        quantity,
        title,
        checks=len(z),
        inside=inside,
        share_inside=inside / len(z),
        confidence95=share_interval(inside, len(z)),
        z_mean=found.mean,
        z_sigma=None if math.isnan(found.sigma) else found.sigma,
        pit=tuple(np.bincount(place, minlength=PIT_BINS).tolist()),
    )
