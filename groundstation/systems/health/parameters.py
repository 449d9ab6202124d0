"""Settings of the autopilot: those off their defaults, and those a flight can check.

What is set comes from the log alone, and so do defaults: a parameter whose default is not logged is not compared.
"""

from collections.abc import Iterator

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import declination_along
from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import topics_of_kind
from groundstation.results.roles import Delays
from groundstation.systems.health.answer import DECLINATION, ChangedParameter, SettingFound, Verdict
from groundstation.systems.health.evidence import Event, Spans
from groundstation.systems.health.world_field import first_position
from groundstation.systems.known import Known
from groundstation.tables.parameters import Parameters, parameters_of
from groundstation.tables.table import Flight

LATEST_WARN_S = 0.05  # of a delay, beside its own interval
DECLINATION_WARN_DEG = 2.0
SIGMAS = 3.0
_DELAYS = ("EKF2_GPS_DELAY", "GPS_DELAY_MS", "GPS1_DELAY_MS")
_BY_DRIVER = ("GPS_DELAY_MS", "GPS1_DELAY_MS")  # 0: that of the receiver's driver
_ARMS = (
    ("EKF2_GPS_POS_X", "EKF2_GPS_POS_Y", "EKF2_GPS_POS_Z"),
    ("GPS_POS1_X", "GPS_POS1_Y", "GPS_POS1_Z"),
    ("GPS1_POS_X", "GPS1_POS_Y", "GPS1_POS_Z"),
)
_ROTATIONS = ("SENS_BOARD_ROT", "AHRS_ORIENTATION")
_UNTOLD = "nothing in this flight measures it"


@dataclass(frozen=True)
class Settings:
    """Settings of a log: how many, those off their defaults, and those that were checked."""

    logged: int
    has_defaults: bool
    differing: tuple[ChangedParameter, ...]
    found: tuple[SettingFound, ...]


def settings_of(flight: Flight, known: Known) -> Settings:
    """Return the settings that a log tells, and what the flight says of them."""
    parameters = parameters_of(flight)
    differing = tuple(
        ChangedParameter(one.name, one.value, one.default)
        for one in parameters.differing
        if one.default is not None and np.isfinite(one.value)
    )
    found = tuple(
        row
        for rows in (_delay, _declination, _arm, _rotation)
        for row in rows(flight, known, parameters)
        if np.isfinite(row.stated)
    )
    return Settings(len(parameters.by_name), parameters.has_defaults, differing, found)


def events(settings: Settings, air: Spans) -> tuple[Event, ...]:
    """Return the settings that were checked as events, at the start of the judged time."""
    start_ns = int(air.start_ns[0]) if len(air.start_ns) else 0
    return tuple(
        Event("settings", start_ns, "warn" if row.verdict == "warn" else "info", row.told, row.source)
        for row in settings.found
        if row.verdict != "not_logged"
    )


def _first(parameters: Parameters, names: tuple[str, ...]) -> tuple[str, float] | None:
    return next(((name, value) for name in names if (value := parameters.value(name)) is not None), None)


def _delay(flight: Flight, known: Known, parameters: Parameters) -> Iterator[SettingFound]:
    """Yield the delay of GNSS beside that by motion.

    It is that of the first pair of INS and GNSS that shows one.
    """
    stated = _first(parameters, _DELAYS)
    if stated is None:
        return
    name, milliseconds = stated
    source, what = parameters.source, "delay of GNSS"
    if name in _BY_DRIVER and milliseconds == 0.0:
        yield SettingFound(name, what, "s", 0.0, None, None, "not_logged", "0: that of the receiver's driver", source)
        return
    delays = known.answer_meeting(Delays)
    pairs = [
        (ins, gnss)
        for ins in topics_of_kind("ins", flight.topics())
        for gnss in topics_of_kind("gnss", flight.topics())
    ]
    observed = [one for one in (delays.observed(*pair) for pair in pairs) if one is not None] if delays else []
    best = next((one for one in observed if one.latency_s is not None), None)
    if best is None or best.latency_s is None:
        yield SettingFound(name, what, "s", milliseconds / 1e3, None, None, "not_logged", _UNTOLD, source)
        return
    sigma = best.sigma_s or 0.0
    is_off = abs(best.latency_s - milliseconds / 1e3) > max(LATEST_WARN_S, SIGMAS * sigma)
    verdict: Verdict = "warn" if is_off else "pass"
    reason = "motion of the autopilot's own estimate against GNSS"
    yield SettingFound(name, what, "s", milliseconds / 1e3, best.latency_s, best.sigma_s, verdict, reason, source)


def stated_declination(parameters: Parameters) -> tuple[str, float | None]:
    """Return the parameter that states the declination, and its value in degrees.

    The value is None where the log has none.
    """
    radians = parameters.value("COMPASS_DEC")
    if radians is not None:
        return "COMPASS_DEC", float(np.rad2deg(radians))
    name = "EKF2_MAG_DECL" if "EKF2_MAG_DECL" in parameters.by_name else "ATT_MAG_DECL"
    return name, parameters.value("EKF2_MAG_DECL", "ATT_MAG_DECL")


def _declination(flight: Flight, _known: Known, parameters: Parameters) -> Iterator[SettingFound]:
    """Yield the declination beside that of the world model at the first position."""
    name, stated = stated_declination(parameters)
    if stated is None:
        return
    what, source = DECLINATION, parameters.source
    if parameters.value("COMPASS_USE") == 0.0:
        yield SettingFound(name, what, "deg", stated, None, None, "not_logged", "no compass in use", source)
        return
    by_table = parameters.value("COMPASS_AUTODEC") == 1.0  # replaces COMPASS_DEC at the first fix, and logs it nowhere
    is_own = stated == 0.0 and (by_table or name != "COMPASS_DEC")
    place = first_position(flight)
    reason = "0: by the autopilot's own table" if is_own else _UNTOLD if place is None else ""
    if is_own or place is None or not flight.has_utc:
        reason = reason or "the log has no date"
        yield SettingFound(name, what, "deg", stated, None, None, "not_logged", reason, source)
        return
    try:
        model = declination_along(*place, flight.start_ns)
    except NotAssessableError as error:
        yield SettingFound(name, what, "deg", stated, None, None, "not_logged", str(error), source)
        return
    found = float(model.values_deg[0])
    sigma = float(model.sigma_deg[0])
    is_off = abs(float(wrap_180(found - stated))) > max(DECLINATION_WARN_DEG, SIGMAS * sigma)
    if is_off and by_table:
        reason = f"COMPASS_AUTODEC 1: the autopilot's own table replaces it at the first fix; {model.model}"
        yield SettingFound(name, what, "deg", stated, found, sigma, "not_logged", reason, source)
        return
    yield SettingFound(name, what, "deg", stated, found, sigma, "warn" if is_off else "pass", model.model, source)


def _arm(_flight: Flight, _known: Known, parameters: Parameters) -> Iterator[SettingFound]:
    """Yield the length of the antenna's arm: the flight does not measure it yet."""
    for names in _ARMS:
        values = [parameters.value(name) for name in names]
        if any(value is not None for value in values):
            known = [value or 0.0 for value in values]
            placed = ", ".join(f"{value:.3g}" for value in known)
            reason = f"{placed} m forward, right, down; {_UNTOLD}" if any(known) else f"not set; {_UNTOLD}"
            name, arm = f"{names[0]}, Y, Z", float(np.linalg.norm(known))
            yield SettingFound(
                name, "arm of the antenna", "m", arm, None, None, "not_logged", reason, parameters.source
            )
            return


def _rotation(_flight: Flight, _known: Known, parameters: Parameters) -> Iterator[SettingFound]:
    """Yield the orientation of the board: the flight does not measure it yet."""
    stated = _first(parameters, _ROTATIONS)
    if stated is not None:
        name, value = stated
        reason = "a number of the firmware's list; nothing in this flight measures it"
        yield SettingFound(
            name, "orientation of the board", "", value, None, None, "not_logged", reason, parameters.source
        )
