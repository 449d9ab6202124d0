"""Errors of an INS over the hours it navigates, of one flight and of many together."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import continuous_longitude_deg, curvature_radii_m
from groundstation.base.records import frozen
from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.methods.intervals import slope_through_origin

FloatArray = NDArray[np.float64]
MOVING_MPS = 10.0  # slower, the track does not say which way is along
STEP_H = 1.0 / 12.0  # of the curves of many flights
LONGEST_GAP_H = 1.0 / 6.0  # across which an error is interpolated
FEWEST = 3  # flights that a curve of many needs
S_PER_H = 3600.0


@dataclass(frozen=True)
class PositionErrors:
    """Position errors of one flight, INS minus reference, at moments both are known, (n,).

    ``hours`` count from the start of navigation; ``along_nmi``, ``cross_nmi`` are NaN where the aircraft hardly moves.
    """

    hours: FloatArray
    radial_nmi: FloatArray
    along_nmi: FloatArray
    cross_nmi: FloatArray

    def __post_init__(self) -> None:
        for name in ("hours", "radial_nmi", "along_nmi", "cross_nmi"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def values(self) -> dict[str, float]:
        """Return the figures of the flight that a limit may bound, by name.

        Those that cannot be had are left out.
        """
        hours, radial = self.hours, self.radial_nmi
        found = {
            "radial_rate_fit_nmiph": slope_through_origin(hours, radial, np.ones(len(hours))),
            "radial_rate_final_nmiph": float(radial[-1] / hours[-1]),
            "radial_final_nmi": float(radial[-1]),
            "radial_largest_nmi": float(radial.max()),
        }
        if np.isfinite(self.along_nmi).any():
            found["along_largest_nmi"] = float(np.nanmax(np.abs(self.along_nmi)))
            found["cross_largest_nmi"] = float(np.nanmax(np.abs(self.cross_nmi)))
        return found


def ins_errors(
    time_s: FloatArray,
    north_error_m: FloatArray,
    east_error_m: FloatArray,
    latitude_deg: FloatArray,
    longitude_deg: FloatArray,
    *,
    start_s: float | None = None,
) -> PositionErrors | None:
    """Errors of a flight over its hours; None where fewer than two positions are compared.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Flight seconds, increasing.
    north_error_m, east_error_m : ndarray, shape (n,)
        INS minus reference, NaN where the reference is missing.
    latitude_deg, longitude_deg : ndarray, shape (n,)
        Of the INS: the way it flew says which direction is along.
    start_s : float, optional
        Flight seconds at which navigation began, perhaps before the log; None: at the first position compared. What
        lies before it does not count.
    """
    known = np.isfinite(north_error_m) & np.isfinite(east_error_m)
    known &= time_s >= (-np.inf if start_s is None else start_s)
    if known.sum() < 2 or not np.ptp(time_s[known]) > 0.0:
        return None
    zero_s = float(time_s[known][0]) if start_s is None else start_s
    along_north, along_east = _direction(time_s, latitude_deg, longitude_deg)
    along = north_error_m * along_north + east_error_m * along_east
    cross = east_error_m * along_north - north_error_m * along_east
    nmi = [values[known] / M_PER_NAUTICAL_MILE for values in (np.hypot(north_error_m, east_error_m), along, cross)]
    return PositionErrors((time_s[known] - zero_s) / S_PER_H, *nmi)


def _direction(
    time_s: FloatArray, latitude_deg: FloatArray, longitude_deg: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the unit vector along the track, north and east.

    NaN where the aircraft hardly moves or its place is not known.
    """
    meridian, prime_vertical = curvature_radii_m(latitude_deg)
    north = np.gradient(np.deg2rad(latitude_deg), time_s) * meridian
    turned_rad = np.deg2rad(continuous_longitude_deg(longitude_deg))
    east = np.gradient(turned_rad, time_s) * prime_vertical * np.cos(np.deg2rad(latitude_deg))
    speed = np.hypot(north, east)
    speed = np.where(speed > MOVING_MPS, speed, np.nan)
    return north / speed, east / speed


@dataclass(frozen=True)
class Growth:
    """Radial errors of many flights at the same hours of navigation.

    ``radial_nmi`` has shape (flights, n), NaN where a flight has no position; a flight counts while it lasts.
    """

    hours: FloatArray
    radial_nmi: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "hours", frozen(self.hours))
        object.__setattr__(self, "radial_nmi", frozen(self.radial_nmi))

    @property
    def flights(self) -> FloatArray:
        """Number of flights that last to each of the hours."""
        return np.asarray(np.isfinite(self.radial_nmi).sum(axis=0), dtype=np.float64)

    def of(self, rows: NDArray[np.intp]) -> "Growth":
        """Return the errors of some of the flights."""
        return Growth(self.hours, self.radial_nmi[rows])

    def within(self, share: float) -> FloatArray:
        """Return the radial error that a share of flights stay within; NaN with fewer than three."""
        found = np.full(len(self.hours), np.nan)
        enough = self.flights >= FEWEST
        found[enough] = np.nanquantile(self.radial_nmi[:, enough], share, axis=0) if enough.any() else np.nan
        return found

    def two_drms(self) -> FloatArray:
        """Twice the root mean square, NaN where there are fewer than three flights."""
        count = self.flights
        squares = np.nansum(self.radial_nmi**2, axis=0) / np.maximum(count, 1.0)
        return np.where(count >= FEWEST, 2.0 * np.sqrt(squares), np.nan)

    def rate(self, error_nmi: FloatArray) -> float | None:
        """Fit a line through the origin to a curve of these hours; None where it has no point.

        Every flight of each hour counts.
        """
        known = np.isfinite(error_nmi)
        if not known.any():
            return None
        return slope_through_origin(self.hours[known], error_nmi[known], self.flights[known])


def growth_of(flights: Sequence[PositionErrors]) -> Growth:
    """Return radial errors at every five minutes.

    They are between moments no more than ten minutes apart.
    """
    longest = max((float(flight.hours[-1]) for flight in flights), default=0.0)
    hours = STEP_H * np.arange(1, int(longest / STEP_H + 1e-9) + 1, dtype=np.float64)
    radial = np.full((len(flights), len(hours)), np.nan)
    for row, flight in enumerate(flights):
        after = np.clip(np.searchsorted(flight.hours, hours), 1, len(flight.hours) - 1)
        gap = flight.hours[after] - flight.hours[after - 1]
        is_known = (hours >= flight.hours[0] - 1e-9) & (hours <= flight.hours[-1] + 1e-9) & (gap <= LONGEST_GAP_H)
        radial[row, is_known] = np.interp(hours, flight.hours, flight.radial_nmi)[is_known]
    return Growth(hours, radial)
