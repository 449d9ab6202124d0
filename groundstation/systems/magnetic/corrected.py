"""Magnetic heading of a whole flight with a deviation added, and how much better it is."""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import declination_along
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.results.roles import Delays
from groundstation.systems.known import AircraftData
from groundstation.systems.magnetic.answer import Residual
from groundstation.systems.magnetic.apply import corrected_by_coefficients, corrected_by_iron, corrected_by_table
from groundstation.systems.magnetic.attitude import levelled_heading_deg
from groundstation.systems.magnetic.deviation_answer import Deviation
from groundstation.systems.magnetic.flown import IN_THE_AIR
from groundstation.systems.magnetic.readings import (
    ANALYSIS,
    FIELD,
    altitude_at,
    current_at,
    latency_of,
    position_at,
    why_not_independent,
)
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.headings import true_from_magnetic
from groundstation.tables.phases import Phases
from groundstation.tables.resample import values_at
from groundstation.tables.table import Flight, Table

Way = Literal["iron", "table", "coefficients"]
LEVELS = ("roll_deg", "pitch_deg")
LEAST_JUDGED = 50  # readings


@dataclass(frozen=True)
class CorrectedHeading:
    """Magnetic heading before and after correction; arrays of shape (n,), in order of time.

    Parameters
    ----------
    topic : str
        Whose samples: a magnetometer's, or those of an INS that logs a magnetic heading.
    ins_topic : str
        INS that levels the field, or whose magnetic heading it is.
    way : {'iron', 'table', 'coefficients'}
        The readings of the field freed of the iron, or a curve added to the heading.
    rows : ndarray of int
        Places of the samples in the table of ``topic``.
    at_ns : ndarray of int64
        Time of validity: of the sample, less the latency of the magnetometer where that is observed.
    uncorrected_deg, magnetic_heading_deg : ndarray
        In [0, 360).
    declination_deg, roll_deg : ndarray
        NaN where unknown.
    lacks_current : bool
        The iron holds the effect of a current that this flight has not logged.
    model : str
        What the declination is of; empty where there is none.
    """

    topic: str
    ins_topic: str
    way: Way
    rows: NDArray[np.intp]
    at_ns: Int64Array
    uncorrected_deg: FloatArray
    magnetic_heading_deg: FloatArray
    declination_deg: FloatArray
    roll_deg: FloatArray
    lacks_current: bool = False
    model: str = ""

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def deviation_deg(self) -> FloatArray:
        """Deviation added to the uncorrected heading, in [-180, 180)."""
        return wrap_180(self.magnetic_heading_deg - self.uncorrected_deg)

    @property
    def true_heading_deg(self) -> FloatArray:
        """Corrected magnetic heading + declination, in [0, 360)."""
        return true_from_magnetic(self.magnetic_heading_deg, self.declination_deg)


def correct_heading(
    flight: Flight,
    deviation: Deviation,
    *,
    settings: MagneticSettings | None = None,
    latencies: Delays | None = None,
) -> CorrectedHeading:
    """Add a deviation to the magnetic heading of a flight, its own or another's.

    Readings of a three-axis magnetometer are levelled by roll and pitch of an INS; where the deviation is that of an
    iron they are freed of it first. A log without such a magnetometer has the curve added to the magnetic heading that
    its INS logs.

    Parameters
    ----------
    flight : Flight
    deviation : Deviation
    settings : MagneticSettings, optional
        Longest gap of the attitude; a declination that is stated.
    latencies : Delays, optional
        Where that of the magnetometer is observed, its times are put back by it.

    Raises
    ------
    NotAssessableError
        When the flight has neither, or the magnetometer is not that of the deviation.
    """
    settings = settings or MagneticSettings()
    sensor = "" if deviation.is_of_heading else _magnetometer(flight, deviation)
    unit = _with_attitude(flight)
    if sensor and unit:
        return _levelled(flight, deviation, (unit, sensor), settings, latencies)
    shown = [topic for topic in topics_of_kind("ins", flight.topics()) if flight[topic].has("magnetic_heading_deg")]
    if not shown:
        what = "an INS with roll and pitch" if sensor else "a three-axis magnetometer"
        raise NotAssessableError(ANALYSIS, f"neither {what} nor a magnetic heading in the log")
    topic = deviation.magnetometer_topic if deviation.magnetometer_topic in shown else shown[0]
    return _as_shown(flight, deviation, topic, settings)


def _magnetometer(flight: Flight, deviation: Deviation) -> str:
    """The magnetometer of the deviation, or the only one; empty where the log has none."""
    found = [topic for topic in topics_of_kind("magnetometer", flight.topics()) if flight[topic].has(*FIELD)]
    if not found or deviation.magnetometer_topic in found:
        return deviation.magnetometer_topic if found else ""
    if len(found) > 1 and deviation.magnetometer_topic:
        raise NotAssessableError(
            ANALYSIS, f"the deviation is that of {deviation.magnetometer_topic}, the log has {', '.join(found)}"
        )
    return found[0]


def _with_attitude(flight: Flight) -> str:
    """Return the first INS with roll and pitch.

    One that has a true heading too comes before others, as the estimator chooses.
    """
    units = [topic for topic in topics_of_kind("ins", flight.topics()) if flight[topic].has(*LEVELS)]
    return next((topic for topic in units if flight[topic].has("true_heading_deg")), units[0] if units else "")


def _levelled(
    flight: Flight,
    deviation: Deviation,
    topics: tuple[str, str],
    settings: MagneticSettings,
    latencies: Delays | None,
) -> CorrectedHeading:
    unit, table = flight[topics[0]].trusted(), flight[topics[1]]
    at_ns = table.time_ns - round(latency_of(topics, latencies) * NS_PER_S)
    roll, pitch = (values_at(unit, name, at_ns, largest_gap_s=settings.gap_max_s) for name in LEVELS)
    field = np.stack([table.values(name) for name in FIELD], axis=-1)
    known = np.isfinite(roll) & np.isfinite(pitch) & np.isfinite(field).all(axis=1) & (np.abs(field).sum(axis=1) > 0.0)
    rows = np.flatnonzero(known)
    if not rows.size:
        raise NotAssessableError(ANALYSIS, f"no reading of {topics[1]} while the attitude of {topics[0]} is known")
    at_ns, roll, pitch, field = at_ns[rows], roll[rows], pitch[rows], field[rows]
    uncorrected = levelled_heading_deg(field, roll, pitch)
    declination, model = _declination(flight, unit, at_ns, settings)
    if deviation.iron is None:
        heading, way = _by_curve(uncorrected, deviation)
        return CorrectedHeading(
            topics[1], topics[0], way, rows, at_ns, uncorrected, heading, declination, roll, model=model
        )
    current = current_at(flight, at_ns)
    heading = corrected_by_iron(field, roll, pitch, deviation.iron, current)
    lacks = deviation.iron.current_effect_nt_per_a is not None and not np.isfinite(current).any()
    return CorrectedHeading(
        topics[1], topics[0], "iron", rows, at_ns, uncorrected, heading, declination, roll, lacks, model
    )


def _as_shown(flight: Flight, deviation: Deviation, topic: str, settings: MagneticSettings) -> CorrectedHeading:
    table = flight[topic]
    rows = np.flatnonzero(table.valid("magnetic_heading_deg"))
    shown = wrap_360(table.values("magnetic_heading_deg")[rows])
    at_ns = table.time_ns[rows]
    declination, model = _declination(flight, table, at_ns, settings)
    heading, way = _by_curve(shown, deviation)
    roll = table.values("roll_deg")[rows]
    return CorrectedHeading(topic, topic, way, rows, at_ns, shown, heading, declination, roll, model=model)


def _by_curve(reading_deg: FloatArray, deviation: Deviation) -> tuple[FloatArray, Way]:
    if deviation.table_deg:
        return corrected_by_table(reading_deg, deviation.table_deg), "table"
    return corrected_by_coefficients(reading_deg, deviation.coefficients_deg), "coefficients"


def _declination(flight: Flight, unit: Table, at_ns: Int64Array, settings: MagneticSettings) -> tuple[FloatArray, str]:
    """Return the declination at given times and its source; NaN where unknown.

    The declination is the stated one, or that of the model of the date.
    """
    if settings.declination_deg is not None:
        return np.full(len(at_ns), settings.declination_deg), "as stated"
    unknown = np.full(len(at_ns), np.nan)
    if not flight.has_utc:
        return unknown, ""
    latitude, longitude = position_at(flight, unit, at_ns)
    try:
        found = declination_along(latitude, longitude, altitude_at(flight, unit, at_ns), int(flight.start_ns))
    except NotAssessableError:  # a date that no model serves
        return unknown, ""
    return found.values_deg, found.model if np.isfinite(found.values_deg).any() else ""


def judge(
    flight: Flight,
    corrected: CorrectedHeading,
    phases: Phases,
    *,
    kinds: dict[str, str],
    ins_error_deg: float = 0.0,
    aircraft: AircraftData | None = None,
    settings: MagneticSettings | None = None,
) -> tuple[Residual, int] | None:
    """Return the RMS heading error in level flight before and after, and the reading count.

    The error is magnetic heading - (INS true heading - declination).

    Parameters
    ----------
    ins_error_deg : float
        What is known of the error of the INS heading, taken off it; so is the mounting in ``aircraft``.
    kinds : mapping of INS topic to kind
        As in :func:`~groundstation.systems.magnetic.estimate.estimate_deviation`.

    Returns
    -------
    Residual and int, or None
        None where the INS has no heading of its own, the declination is not known or hardly any reading is level and in
        the air.
    """
    settings = settings or MagneticSettings()
    unit = corrected.ins_topic
    if not flight[unit].has("true_heading_deg") or why_not_independent(flight, unit, kinds, settings):
        return None
    true = values_at(flight[unit].trusted(), "true_heading_deg", corrected.at_ns, largest_gap_s=settings.gap_max_s)
    mounting = aircraft.mounting_deg if aircraft else 0.0
    expected = true - mounting - ins_error_deg - corrected.declination_deg
    is_airborne = np.isin(phases.at(flight.seconds(corrected.at_ns)), IN_THE_AIR)
    is_level = np.abs(corrected.roll_deg) <= settings.held_out_bank_max_deg
    judged = np.flatnonzero(is_airborne & is_level & np.isfinite(expected))
    if len(judged) < LEAST_JUDGED:
        return None
    before, after = (
        float(np.sqrt(np.mean(wrap_180(heading[judged] - expected[judged]) ** 2)))
        for heading in (corrected.uncorrected_deg, corrected.magnetic_heading_deg)
    )
    return Residual(before, after), len(judged)


def thinned(corrected: CorrectedHeading, most: int) -> CorrectedHeading:
    """Return at most ``most`` samples: of more, every k-th."""
    kept = slice(None, None, max(1, -(-len(corrected) // most)))
    names = ("rows", "at_ns", "uncorrected_deg", "magnetic_heading_deg", "declination_deg", "roll_deg")
    return replace(corrected, **{name: getattr(corrected, name)[kept] for name in names})
