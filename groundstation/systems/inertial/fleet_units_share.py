"""Share of a flight in the history of its INS: rate, tilt, azimuth and drifts by serial."""

import math
from typing import Any

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.quantiles import NORMAL_95
from groundstation.methods.ins_noise import DEFAULT_CLASS
from groundstation.results.arrays.typed import MissingColumnError
from groundstation.results.files import SavedFlight, mapping
from groundstation.results.fleet_share import to_number
from groundstation.results.fleet_units import UnitOfFlight
from groundstation.systems.inertial.alignment_answer import GroundResult
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.arrays import InertialStates
from groundstation.systems.inertial.units_answer import InsUnit, Measured, UnitsResult
from groundstation.systems.inertial.units_limits import limits_of
from groundstation.systems.inertial.units_log import serials_of

SEEN = 0.5  # observability of a drift that the flight shows
GRAVITY_MPS2, RADIUS_M = 9.80665, 6_371_000.0
SCHULER_RADPS = math.sqrt(GRAVITY_MPS2 / RADIUS_M)
LONGEST_FIT_S = 2.0 * math.pi / SCHULER_RADPS  # one Schuler period from the start
SHORTEST_FIT_S = 0.5 * LONGEST_FIT_S
LATEST_BEGIN_S = 600.0  # of the first comparison behind the start of navigation
ARCSEC_PER_RAD = 206_264.8
CHANGES = "its serial changes in flight"


def units_of(saved: SavedFlight) -> tuple[UnitOfFlight, ...]:
    """Return what each INS of a flight adds to the history of its unit; none without an INS."""
    inertial, units = saved.results.answer(InertialResult), saved.results.answer(UnitsResult)
    if units is not None:
        return tuple(_of_several(saved, units, one, inertial) for one in units.units)
    return () if inertial is None else (_of_one(saved, inertial),)


def _of_one(saved: SavedFlight, inertial: InertialResult) -> UnitOfFlight:
    serials = [serial for _, serial in serials_of(_said(saved, "ins_serial"))]
    reason = CHANGES if len(serials) > 1 else _reason(inertial)
    figures = {} if reason else _figures(saved, inertial)
    return UnitOfFlight(inertial.ins_topic, serials[0] if serials else "", reason, **figures)


def _of_several(saved: SavedFlight, units: UnitsResult, unit: InsUnit, inertial: InertialResult | None) -> UnitOfFlight:
    serial = unit.serials[0] if unit.serials else ""
    reason = _reason_of_unit(units, unit)
    if reason:
        return UnitOfFlight(unit.topic, serial, reason)
    figures: dict[str, Any] = {}
    if inertial is not None and inertial.ins_topic == unit.topic and not _reason(inertial):
        figures |= _figures(saved, inertial)
    if unit.rate_fit_nmiph is not None:
        figures |= {"rate_nmiph": unit.rate_fit_nmiph.value, "rate_nmiph_half95": unit.rate_fit_nmiph.half95}
        figures |= _limit(unit.ins_class or units.ins_class, unit.compared_hours)
    return UnitOfFlight(unit.topic, serial, **figures)


def _reason(inertial: InertialResult) -> str:
    """Reason why the figures of an INS do not count; empty where they do."""
    if inertial.kind != "unaided":
        return "GNSS corrects it" if inertial.kind == "gnss_aided" else "GNSS may correct it"
    start = inertial.navigation_start
    if start is None or start.time_s is None:
        return "nothing shows when navigation began"
    return ""


def _reason_of_unit(units: UnitsResult, unit: InsUnit) -> str:
    if unit.same_as:
        return f"it repeats {unit.same_as}"
    if len(unit.serials) > 1:
        return CHANGES
    if unit.kind != "unaided":
        return "GNSS corrects it" if unit.kind == "gnss_aided" else "GNSS may correct it"
    if not unit.has_position:
        return "it logs no position"
    own = [one for one in units.faults if one.topics == (unit.topic,)]
    if any(one.kind == "frozen" or (one.kind == "step" and one.unit == "m") for one in own):
        return "its position was set or stood still in flight"
    return "" if unit.start_s is not None else "nothing shows when navigation began"


def _figures(saved: SavedFlight, inertial: InertialResult) -> dict[str, Any]:
    """Figures of the INS of the chapter on INS errors."""
    found: dict[str, Any] = {"rate_nmiph": to_number(inertial.radial_error_rate_fit_nmiph)}
    found |= _limit(inertial.ins_class, inertial.compared_hours)
    azimuth = inertial.azimuth
    if azimuth is not None and azimuth.observable:
        found |= {
            "azimuth_deg": to_number(azimuth.error_deg),
            "azimuth_deg_half95": NORMAL_95 * to_number(azimuth.sigma_deg),
        }
    for channel in inertial.channels:
        drift = next((one for one in channel.states if one.name == "drift"), None)
        if drift is not None and to_number(drift.observability) >= SEEN:
            name = f"drift_{channel.name}_dph"
            found |= {name: to_number(drift.value), f"{name}_half95": NORMAL_95 * to_number(drift.sigma)}
    return found | _tilt(saved, inertial)


def _limit(ins_class: str, hours: float | None) -> dict[str, Any]:
    """Rate that an honest unit of the class exceeds in one of 250 flights of this length."""
    if not hours or not math.isfinite(hours):
        return {}
    found = limits_of(ins_class, hours, is_start_known=True)
    told = ins_class if found is not None else DEFAULT_CLASS
    found = found or limits_of(DEFAULT_CLASS, hours, is_start_known=True)
    return {"ins_class": told, "limit_nmiph": math.nan if found is None else found.single.rate_nmiph}


def _tilt(saved: SavedFlight, inertial: InertialResult) -> dict[str, Any]:
    """Tilt at the start of navigation, by the smoother where the flight has it.

    Else by the velocity error of the first Schuler period.
    """
    ground = saved.results.answer(GroundResult)
    if ground is not None and ground.ins_topic == inertial.ins_topic and ground.at_start is not None:
        north_arcsec, east_arcsec = ground.at_start.tilt_north_arcsec, ground.at_start.tilt_east_arcsec
        if north_arcsec is not None and east_arcsec is not None:
            return _length(north_arcsec, east_arcsec)
    try:
        states = saved.rows_of(InertialStates)
    except MissingColumnError:
        states = None
    start = inertial.navigation_start
    if states is None or start is None or start.time_s is None:
        return {}
    since = states.time_s - start.time_s
    found = [tilt_rad(since, one.measured_velocity_mps) for one in (states.north, states.east)]
    (north, east) = found
    if north is None or east is None:
        return {}
    return _length(*(Measured(ARCSEC_PER_RAD * one[0], ARCSEC_PER_RAD * NORMAL_95 * one[1]) for one in (north, east)))


def _length(north: Measured, east: Measured) -> dict[str, Any]:
    """Return the size of a tilt from its parts, with half of its interval."""
    size = math.hypot(north.value, east.value)
    half = math.hypot(north.value * north.half95, east.value * east.half95) / size if size > 0.0 else 0.0
    return {"tilt_arcsec": size, "tilt_arcsec_half95": half or max(north.half95, east.half95)}


def tilt_rad(since_s: FloatArray, velocity_mps: FloatArray) -> tuple[float, float] | None:
    """Return the tilt of a channel at the start of navigation and its sigma.

    None where too little is known.

    The velocity error of the first Schuler period is a constant, a ramp and a Schuler wave; its derivative at the start
    is -g tilt. The sigma is that of least squares with the residuals' own scatter, as many of them as are independent.

    Examples
    --------
    >>> time = np.arange(0.0, 5000.0, 10.0)
    >>> velocity = -5e-5 * GRAVITY_MPS2 / SCHULER_RADPS * np.sin(SCHULER_RADPS * time)
    >>> round(1e6 * tilt_rad(time, velocity)[0], 3)
    50.0
    """
    own = np.isfinite(velocity_mps) & (since_s >= 0.0) & (since_s <= LONGEST_FIT_S)
    time, velocity = since_s[own], velocity_mps[own]
    if len(time) < 10 or time[0] > LATEST_BEGIN_S or time[-1] - time[0] < SHORTEST_FIT_S:
        return None
    phase = SCHULER_RADPS * time
    design = np.column_stack([np.ones(len(time)), time, np.cos(phase), np.sin(phase)])
    scale = np.abs(design).max(axis=0)
    values, _, rank, _ = np.linalg.lstsq(design / scale, velocity, rcond=None)
    if rank < 4:
        return None
    row = np.array([0.0, 1.0, 0.0, SCHULER_RADPS]) / scale / -GRAVITY_MPS2
    residual = velocity - design / scale @ values
    spread = float(residual @ residual) / max(len(time) - 4, 1)
    alike = float(residual[1:] @ residual[:-1]) / (float(residual @ residual) or 1.0)
    alike = min(max(alike, 0.0), 0.999)
    covariance = np.linalg.inv((design / scale).T @ (design / scale))
    variance = spread * float(row @ covariance @ row) * (1.0 + alike) / (1.0 - alike)
    return float(row @ values), math.sqrt(max(variance, 0.0))


def _said(saved: SavedFlight, key: str) -> str:
    """Value that the aircraft file of the run says, else the head of the log."""
    stated = mapping(saved.manifest.configuration, "aircraft").get(key)
    return str(stated or saved.results.metadata.get(key, "")).strip()
