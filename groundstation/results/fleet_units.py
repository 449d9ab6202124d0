"""INS units of a fleet by serial: where each sat, how its errors change, date of a limit."""

from collections.abc import Mapping
from dataclasses import field
from typing import Literal, NamedTuple

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import check_ranges, number, required_number
from groundstation.results.arrays.typed import Arrays, Floats, Texts, Times

UnitEventKind = Literal["moved", "replaced", "changed", "gap", "two_aircraft", "clock", "spelled_alike"]
UnitOutlook = Literal["over", "may_be_over", "due", "steady", "few", "no_rate"]


class UnitFigure(NamedTuple):
    """A figure of a unit that is followed over time.

    ``is_positive``: a size, which has no sign.
    """

    title: str
    unit: str
    decimals: int
    is_positive: bool


RATE = "rate_nmiph"
UNIT_FIGURES: Mapping[str, UnitFigure] = {
    RATE: UnitFigure("radial error rate", "nmi/h", 2, True),
    "tilt_arcsec": UnitFigure("tilt at the start", "″", 1, True),
    "azimuth_deg": UnitFigure("azimuth error", "°", 3, False),
    "drift_north_dph": UnitFigure("gyro drift, north channel", "°/h", 4, False),
    "drift_east_dph": UnitFigure("gyro drift, east channel", "°/h", 4, False),
}


@dataclass(frozen=True)
class UnitOfFlight:
    """Contribution of one INS of one flight to the history of its unit.

    Parameters
    ----------
    topic : str
    ins_serial : str
        Empty where nobody states it.
    reason : str
        Why its figures do not count; empty where they do.
    limit_nmiph : float
        Rate that an honest unit of its class exceeds in one of 250 flights of this length; NaN where it is not known.
    ins_class : str
    rate_nmiph, tilt_arcsec, azimuth_deg, drift_north_dph, drift_east_dph : float
        NaN where the flight does not show it; ``*_half95`` is half of the 95 % interval of the measurement.
    """

    topic: str
    ins_serial: str
    reason: str = ""
    ins_class: str = ""
    limit_nmiph: float = float("nan")
    rate_nmiph: float = float("nan")
    rate_nmiph_half95: float = float("nan")
    tilt_arcsec: float = float("nan")
    tilt_arcsec_half95: float = float("nan")
    azimuth_deg: float = float("nan")
    azimuth_deg_half95: float = float("nan")
    drift_north_dph: float = float("nan")
    drift_north_dph_half95: float = float("nan")
    drift_east_dph: float = float("nan")
    drift_east_dph_half95: float = float("nan")


@dataclass(frozen=True)
class UnitLimit:
    """Limit on the rate of one unit, named by its serial."""

    ins_serial: str
    rate_nmiph: float = required_number(1e-6, 1e6)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class UnitLimits:
    """Limits stated by the user: the rate at which a unit is to be calibrated.

    Parameters
    ----------
    rate_nmiph : float, optional
        Of all units; None: that of the class.
    heading_error_deg : float, optional
        Of the heading error of an aircraft, to either side, for the date at which its slope reaches it.
    months_ahead : float
        A unit without a trend is called steady when its interval stays below the limit for so long.
    gap_days : float
        A pause of a unit longer than that is listed.
    serials : tuple of UnitLimit
        Of single units.
    """

    rate_nmiph: float | None = number(None, 1e-6, 1e6)
    heading_error_deg: float | None = number(None, 1e-6, 180.0)
    months_ahead: float = number(12.0, 0.1, 120.0)
    gap_days: float = number(90.0, 1.0, 36_500.0)
    serials: tuple[UnitLimit, ...] = field(default=())

    def __post_init__(self) -> None:
        check_ranges(self)
        names = [one.ins_serial for one in self.serials]
        if len(set(names)) < len(names):
            raise SettingsError("serials", "two of one ins_serial", "serials that differ")


@dataclass(frozen=True)
class UnitTrendRow:
    """A figure of a unit over its flights since its last change.

    ``level`` is the line at the last flight, ``slope_per_year`` its slope; both with the ends of the 95 % interval,
    None with fewer than six flights. ``scatter`` is the robust spread of the flights about it.
    """

    ins_serial: str
    quantity: str
    flights: int
    since_utc_ns: int | None
    level: float | None = None
    level_low: float | None = None
    level_high: float | None = None
    slope_per_year: float | None = None
    slope_low_per_year: float | None = None
    slope_high_per_year: float | None = None
    scatter: float | None = None
    changes: int = 0


@dataclass(frozen=True)
class UnitEventRow:
    """Event in the life of a unit: a move, a change of level, a pause, a doubt on its serial.

    ``flight_id`` is the first flight behind it, ``quantity`` the figure of a change, empty for others.
    """

    kind: UnitEventKind
    ins_serial: str
    aircraft: str
    flight_id: str
    start_utc_ns: int | None
    text: str
    quantity: str = ""


@dataclass(frozen=True)
class FleetUnitRow:
    """One unit over all its flights.

    Parameters
    ----------
    place : int
        Counts the units from 1.
    ins_serial : str
    aircraft : str
        In the order in which it flew in them, joined by ", "; ``fitted_to`` is the last one.
    flights, counted, undated : int
        Flights that state the serial, those with a rate and a date, those without a date that can be believed.
    rate_nmiph, rate_low_nmiph, rate_high_nmiph : float or None
        Typical rate now: the line at the last flight. Without a line the median of the flights, and no interval.
    slope_nmiph_per_year, slope_low_nmiph_per_year, slope_high_nmiph_per_year : float or None
    limit_nmiph : float or None
        ``limit_by`` says whose it is.
    outlook : str
        ``over``, ``may_be_over`` the limit now; ``due``: the trend reaches it; ``steady``: no trend; ``few``: too few
        flights, ``flights_missing`` more are needed; ``no_rate``: no flight shows a rate.
    due_utc_ns, due_earliest_utc_ns, due_latest_utc_ns : int or None
        Date at which the trend reaches the limit, with its 95 % interval; ``due_utc_ns`` only where there is a trend.
    text : str
        The outlook in one line.
    """

    place: int
    ins_serial: str
    aircraft: str
    fitted_to: str
    first_flight: str
    last_flight: str
    first_utc_ns: int | None
    last_utc_ns: int | None
    flights: int
    counted: int
    undated: int
    rate_nmiph: float | None
    rate_low_nmiph: float | None
    rate_high_nmiph: float | None
    slope_nmiph_per_year: float | None
    slope_low_nmiph_per_year: float | None
    slope_high_nmiph_per_year: float | None
    limit_nmiph: float | None
    limit_by: str
    outlook: UnitOutlook
    due_utc_ns: int | None
    due_earliest_utc_ns: int | None
    due_latest_utc_ns: int | None
    flights_missing: int | None
    text: str


class FleetUnitFlights(Arrays, figure="unit_flights"):
    """Every INS of every flight, by serial and time; those without a serial first.

    ``reason`` says why its figures do not count, ``why_undated`` why its date does not. ``line_nmiph`` is the trend
    of the rate since the last change, with its 95 % interval.
    """

    ins_serial: Texts
    aircraft: Texts
    flight_id: Texts
    start_utc: Times
    topic: Texts
    reason: Texts
    why_undated: Texts
    ins_class: Texts
    limit_nmiph: Floats
    rate_nmiph: Floats
    rate_nmiph_half95: Floats
    tilt_arcsec: Floats
    tilt_arcsec_half95: Floats
    azimuth_deg: Floats
    azimuth_deg_half95: Floats
    drift_north_dph: Floats
    drift_north_dph_half95: Floats
    drift_east_dph: Floats
    drift_east_dph_half95: Floats
    line_nmiph: Floats
    line_low_nmiph: Floats
    line_high_nmiph: Floats

    def figure_of(self, quantity: str) -> Floats:
        """Return a figure of :data:`UNIT_FIGURES` or its ``_half95``."""
        return self.columns[quantity]
