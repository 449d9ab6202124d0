"""Table of runways: ends, thresholds, courses, and how far each row may be off.

A row gives the middle of both ends and, apart from them, the length. Coordinates that are not as far apart as the
runway is long are wrong by about the difference: that is the only check a row has in itself, and it widens the sigmas
of that row. Some rows give the displaced threshold in place of the end; the same check tells which.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, direction_of, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import METRES_PER_DEG, latitude_longitude_deg, north_east_m
from groundstation.base.records import BoolArray

CoordinatesOf = Literal["end", "threshold", "end or threshold"]
Texts = NDArray[np.str_]

# Sigmas, judged by benchmarks/runways_against_published.py: thresholds of the table against published ones.
SHIFT_SIGMA_M = 15.0  # of a whole runway, on each axis
END_SIGMA_M = 10.0  # of one end beside the other
ELEVATION_SIGMA_M = 5.0  # of a threshold: some rows have the airfield's elevation at both ends; not measured
THRESHOLD_SIGMA_M = 70.0  # along the runway besides: displacements that are missing, or changed since
AGREES_M = 30.0  # a length that is so near the distance between the ends confirms them
LONGEST_M = 6_000.0  # of the runways there are


@dataclass(frozen=True, kw_only=True)
class RunwayDirection:
    """A runway in one direction of landing.

    Parameters
    ----------
    airport, name, opposite : str
        Identifiers as the table has them: "ENGM", "01L", "19R".
    latitude_deg, longitude_deg : float
        Of the threshold: the end plus the displacement along the runway.
    end_latitude_deg, end_longitude_deg, far_latitude_deg, far_longitude_deg : float
        Of both ends, in the direction of landing.
    true_course_deg, course_sigma_deg : float
        Direction from the one end to the other, true.
    displaced_m : float
        From the end to the threshold.
    length_m, landing_length_m : float
        From end to end as stated, and from the threshold to the far end.
    elevation_m, slope : float or None
        Of the threshold above mean sea level; rise per metre along the landing. None where an end has no elevation.
    mismatch_m : float or None
        Distance between the ends less the stated length; None where no length is stated.
    coordinates_of : {'end', 'threshold', 'end or threshold'}
        Place that the row's coordinates of this end are taken for.
    along_sigma_m, across_sigma_m : float
        Of the threshold, on the runway's axes.
    """

    airport: str
    name: str
    opposite: str
    latitude_deg: float
    longitude_deg: float
    end_latitude_deg: float
    end_longitude_deg: float
    far_latitude_deg: float
    far_longitude_deg: float
    true_course_deg: float
    course_sigma_deg: float
    displaced_m: float
    length_m: float
    landing_length_m: float
    width_m: float | None
    elevation_m: float | None
    slope: float | None
    surface: str
    is_closed: bool
    mismatch_m: float | None
    coordinates_of: CoordinatesOf
    along_sigma_m: float
    across_sigma_m: float

    @property
    def full_name(self) -> str:
        """Airport and runway."""
        return f"{self.airport} {self.name}"

    @property
    def is_water(self) -> bool:
        """Tell whether it is a lane on water."""
        return "WAT" in self.surface.upper()

    def distance_m(self, latitude_deg: float, longitude_deg: float) -> float:
        """Distance from a place to the nearest point of the runway's centre line."""
        north, east = north_east_m(
            [latitude_deg, self.far_latitude_deg],
            [longitude_deg, self.far_longitude_deg],
            self.end_latitude_deg,
            self.end_longitude_deg,
        )
        length_m = float(np.hypot(north[1], east[1]))
        share = float(np.clip((north[0] * north[1] + east[0] * east[1]) / max(length_m, 1.0) ** 2, 0.0, 1.0))
        return float(np.hypot(north[0] - share * north[1], east[0] - share * east[1]))


@dataclass(frozen=True, eq=False, kw_only=True)
class RunwayTable:
    """Runways with the coordinates of both ends, by growing latitude of the first.

    Arrays have shape (n,), those of ends (2, n); NaN or 0 where the source states nothing.

    Parameters
    ----------
    source, licence, dated, digest : str
        Where the rows come from; ISO date of the file; SHA-256 of its content.
    rows : int
        Rows of the source.
    left_out : mapping of str to int
        Rows that are not in the table, by reason.
    """

    source: str
    licence: str
    dated: str
    digest: str
    rows: int
    left_out: dict[str, int]
    airport: Texts
    surface: Texts
    name: Texts
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    elevation_m: FloatArray
    displaced_m: FloatArray
    length_m: FloatArray
    width_m: FloatArray
    is_closed: BoolArray

    def __len__(self) -> int:
        """Return the number of runways."""
        return len(self.airport)

    @property
    def version(self) -> str:
        """Source, date and the head of the digest: "OurAirports 2026-11-24 (1fb3eea0)"."""
        return f"{self.source} {self.dated} ({self.digest[:8]})"

    def near(
        self,
        latitude_deg: float,
        longitude_deg: float,
        within_m: float,
        course_deg: float | None = None,
        tolerance_deg: float = 90.0,
    ) -> tuple[RunwayDirection, ...]:
        """Return directions of runways within a distance of a place, the nearest first.

        With a true course, only those that agree with it to the tolerance.

        Examples
        --------
        >>> from groundstation.base.runways.kept import shipped_runways
        >>> oslo = shipped_runways().near(60.187, 11.074, 1_000.0, 16.0, 12.0)
        >>> [one.full_name for one in oslo], round(oslo[0].true_course_deg, 1), round(oslo[0].length_m)
        (['ENGM 01L'], 16.1, 3600)
        """
        if not (np.isfinite(latitude_deg) and np.isfinite(longitude_deg)):
            return ()
        reach_m = within_m + LONGEST_M
        reach_deg = reach_m / METRES_PER_DEG * 1.02
        first, last = np.searchsorted(self.latitude_deg[0], [latitude_deg - reach_deg, latitude_deg + reach_deg])
        band = np.arange(first, last)
        if abs(latitude_deg) + reach_deg < 89.0:
            wide_deg = reach_deg / np.cos(np.deg2rad(abs(latitude_deg) + reach_deg))
            band = band[np.abs(wrap_180(self.longitude_deg[0, band] - longitude_deg)) <= wide_deg]
        found = []
        for row in band:
            for one in self.directions(int(row)):
                distance_m = one.distance_m(latitude_deg, longitude_deg)
                turned_deg = 0.0 if course_deg is None else abs(float(wrap_180(course_deg - one.true_course_deg)))
                if distance_m <= within_m and turned_deg <= tolerance_deg:
                    found.append((distance_m, one.full_name, one))
        return tuple(one for _distance, _name, one in sorted(found, key=lambda item: item[:2]))

    def of_airport(self, airport: str) -> tuple[RunwayDirection, ...]:
        """Return every direction of the runways of an airport by its identifier, in any case."""
        rows = np.flatnonzero(np.char.upper(self.airport) == airport.upper())
        found = [one for row in rows for one in self.directions(int(row))]
        return tuple(sorted(found, key=lambda one: one.name))

    def without(self, row: int) -> "RunwayTable":
        """Return the table without a row."""
        names = ("airport", "surface", "name", "latitude_deg", "longitude_deg", "elevation_m", "displaced_m")
        arrays = {name: np.delete(getattr(self, name), row, axis=-1) for name in names}
        arrays |= {name: np.delete(getattr(self, name), row) for name in ("length_m", "width_m", "is_closed")}
        return replace(self, **arrays)

    def directions(self, row: int) -> Iterator[RunwayDirection]:
        """Yield a row in both directions."""
        places = _places_given(self.length_m[row], self.displaced_m[:, row], self._between_m(row))
        for end in (0, 1):
            yield self._direction(row, end, places)

    def _between_m(self, row: int) -> float:
        """Return the distance between the coordinates of both ends."""
        north, east = north_east_m(
            self.latitude_deg[1, row], self.longitude_deg[1, row], self.latitude_deg[0, row], self.longitude_deg[0, row]
        )
        return float(np.hypot(north, east))

    def _direction(self, row: int, end: int, places: "_PlacesGiven") -> RunwayDirection:
        far = 1 - end
        latitude, longitude = float(self.latitude_deg[end, row]), float(self.longitude_deg[end, row])
        north, east = north_east_m(self.latitude_deg[far, row], self.longitude_deg[far, row], latitude, longitude)
        between_m = float(np.hypot(north, east))
        course_deg = float(direction_of(float(north), float(east)))
        unit = np.array([float(north), float(east)]) / between_m
        displaced = float(self.displaced_m[end, row])
        to_end_m, to_threshold_m = (-displaced, 0.0) if places.of[end] == "threshold" else (0.0, displaced)
        to_far_m = between_m + (float(self.displaced_m[far, row]) if places.of[far] == "threshold" else 0.0)
        at = {
            name: tuple(
                float(one) for one in latitude_longitude_deg(along * unit[0], along * unit[1], latitude, longitude)
            )
            for name, along in (("end", to_end_m), ("threshold", to_threshold_m), ("far", to_far_m))
        }
        length_m = float(self.length_m[row]) if self.length_m[row] > 0.0 else to_far_m - to_end_m
        rise = float(self.elevation_m[far, row] - self.elevation_m[end, row])
        slope = rise / length_m if np.isfinite(rise) else None
        elevation_m = float(self.elevation_m[end, row])
        wrong_m = np.sqrt(0.5) * abs(places.mismatch_m or 0.0)  # shared between both ends, nobody knows how
        sigma_m = float(np.hypot(np.hypot(SHIFT_SIGMA_M, END_SIGMA_M), wrong_m))
        unsure_m = 0.5 * displaced if places.of[end] == "end or threshold" else 0.0
        return RunwayDirection(
            airport=str(self.airport[row]),
            name=str(self.name[end, row]),
            opposite=str(self.name[far, row]),
            latitude_deg=at["threshold"][0],
            longitude_deg=at["threshold"][1],
            end_latitude_deg=at["end"][0],
            end_longitude_deg=at["end"][1],
            far_latitude_deg=at["far"][0],
            far_longitude_deg=at["far"][1],
            true_course_deg=course_deg,
            course_sigma_deg=min(float(np.rad2deg(np.hypot(np.sqrt(2.0) * END_SIGMA_M, wrong_m) / between_m)), 90.0),
            displaced_m=displaced,
            length_m=length_m,
            landing_length_m=max(length_m - displaced, 0.0),
            width_m=float(self.width_m[row]) if self.width_m[row] > 0.0 else None,
            elevation_m=(elevation_m + displaced * (slope or 0.0)) if np.isfinite(elevation_m) else None,
            slope=slope,
            surface=str(self.surface[row]),
            is_closed=bool(self.is_closed[row]),
            mismatch_m=places.mismatch_m,
            coordinates_of=places.of[end],
            along_sigma_m=float(np.hypot(np.hypot(sigma_m, THRESHOLD_SIGMA_M), unsure_m)),
            across_sigma_m=sigma_m,
        )


@dataclass(frozen=True)
class _PlacesGiven:
    """Places that a row's coordinates are taken for, and the length that is then left."""

    of: tuple[CoordinatesOf, CoordinatesOf]
    mismatch_m: float | None


def _places_given(length_m: float, displaced_m: FloatArray, between_m: float) -> _PlacesGiven:
    """Return what the distance between the coordinates says of them.

    Rows are taken for ends, as the source defines them, unless the length surely says otherwise.

    Examples
    --------
    >>> _places_given(3000.0, np.array([300.0, 0.0]), 2995.0)
    _PlacesGiven(of=('end', 'end'), mismatch_m=-5.0)
    >>> _places_given(3000.0, np.array([300.0, 0.0]), 2704.0)
    _PlacesGiven(of=('threshold', 'end'), mismatch_m=4.0)
    >>> _places_given(3000.0, np.array([300.0, 0.0]), 2850.0)
    _PlacesGiven(of=('end or threshold', 'end'), mismatch_m=-150.0)
    """
    if not length_m > 0.0:
        return _PlacesGiven(("end", "end"), None)
    as_ends_m = between_m - length_m
    if abs(as_ends_m) <= AGREES_M or not np.any(displaced_m > 0.0):
        return _PlacesGiven(("end", "end"), float(as_ends_m))
    left = {
        (first, second): float(as_ends_m + first * displaced_m[0] + second * displaced_m[1])
        for first, second in product((False, True), repeat=2)
        if (displaced_m[0] > 0.0 or not first) and (displaced_m[1] > 0.0 or not second)
    }
    agreeing = [which for which, rest in left.items() if abs(rest) <= AGREES_M]
    if len(agreeing) == 1:
        first, second = agreeing[0]
        of: tuple[CoordinatesOf, CoordinatesOf] = "threshold" if first else "end", "threshold" if second else "end"
        return _PlacesGiven(of, left[agreeing[0]])
    either: tuple[CoordinatesOf, ...] = tuple("end or threshold" if one > 0.0 else "end" for one in displaced_m)
    return _PlacesGiven((either[0], either[1]), float(as_ends_m))
