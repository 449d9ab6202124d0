"""Trends of the flights of an aircraft: changes of level, slopes, date of a limit."""

from typing import Literal

from groundstation.base.dataclasses import dataclass

NS_PER_DAY = 86_400_000_000_000
DAYS_PER_YEAR = 365.25
TrendQuantity = Literal[
    "error_deg",
    "radial_error_rate_fit_nmiph",
    "health_vibration_mps2",
    "health_hdop",
    "health_test_ratio",
    "onboard_heading_rms_deg",
    "onboard_tilt_rms_deg",
]


@dataclass(frozen=True)
class ChangePoint:
    """Flight from which on a quantity of an aircraft has another level.

    ``flight_id`` is the first flight of the new level; ``level_before`` and ``level_after`` are medians, in the unit of
    ``quantity``; ``p_value`` the chance of so large a step anywhere in a steady series.
    """

    aircraft: str
    quantity: TrendQuantity
    flight_id: str
    start_utc_ns: int
    flights_before: int
    flights_after: int
    level_before: float
    level_after: float
    p_value: float


@dataclass(frozen=True)
class SlopeRow:
    """Line through a charted quantity of an aircraft since its last change of level.

    Parameters
    ----------
    aircraft : str
    quantity : str
    flights : int
        Flights of the line, at least six.
    since_utc_ns, last_utc_ns : int
        Starts of the first and the last of them.
    level, level_low, level_high : float
        The line at the last flight with the ends of its 95 % interval, in the unit of ``quantity``.
    slope_per_year, slope_low_per_year, slope_high_per_year : float
        Slope with its 95 % interval.
    slope_per_flight : float
        Slope times the mean time between these flights.
    is_slope : bool
        True where the flights show a change of level which a line explains as well as a step.
    limit : float or None
        Limit that is stated, of the size of ``quantity``.
    is_over : bool
        True where the line is beyond the limit at the last flight.
    due_utc_ns, due_earliest_utc_ns, due_latest_utc_ns : int or None
        Date at which a slope reaches the limit, with its 95 % interval; None where it does not within ten years.
    """

    aircraft: str
    quantity: TrendQuantity
    flights: int
    since_utc_ns: int
    last_utc_ns: int
    level: float
    level_low: float
    level_high: float
    slope_per_year: float
    slope_low_per_year: float
    slope_high_per_year: float
    slope_per_flight: float
    is_slope: bool = False
    limit: float | None = None
    is_over: bool = False
    due_utc_ns: int | None = None
    due_earliest_utc_ns: int | None = None
    due_latest_utc_ns: int | None = None

    @property
    def per_flight(self) -> tuple[float, float, float]:
        """Slope per flight with the ends of its interval."""
        days = (self.last_utc_ns - self.since_utc_ns) / NS_PER_DAY / (self.flights - 1)
        years = days / DAYS_PER_YEAR
        return self.slope_per_flight, self.slope_low_per_year * years, self.slope_high_per_year * years
