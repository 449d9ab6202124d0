"""Magnetic declination along a flight, from the world magnetic model of its date."""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np

from groundstation.base.angles import FloatArray, unwrap, wrap_180
from groundstation.base.errors import NotAssessableError
from groundstation.base.geodesy import SEMI_MAJOR_M
from groundstation.base.records import frozen
from groundstation.base.timescales import utc_ns_to_iso

MODEL_YEARS = range(2010, 2030, 5)  # base years of the sets that pygeomag brings; each serves five years
KNOT_SPACING_M = 5_000.0
M_PER_DEG = SEMI_MAJOR_M * np.pi / 180.0
SIGMA_FLOOR_DEG, SIGMA_SLOPE_DEG_NT = 0.26, 5417.0


@dataclass(frozen=True)
class Declination:
    """Declination at given positions.

    Parameters
    ----------
    values_deg : ndarray, shape (n,)
        East positive, in [-180, 180); NaN where the position is not known.
    horizontal_nt : ndarray, shape (n,)
        Horizontal intensity H.
    down_nt : ndarray, shape (n,)
        Vertical intensity Z, down positive.
    model : str
        Name of the model: ``WMM-2020``.
    """

    values_deg: FloatArray
    horizontal_nt: FloatArray
    down_nt: FloatArray
    model: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "values_deg", frozen(self.values_deg))
        object.__setattr__(self, "horizontal_nt", frozen(self.horizontal_nt))
        object.__setattr__(self, "down_nt", frozen(self.down_nt))

    @property
    def sigma_deg(self) -> FloatArray:
        """Standard deviation of the model's declination, shape (n,)."""
        return declination_sigma_deg(self.horizontal_nt)


def declination_sigma_deg(horizontal_nt: FloatArray) -> FloatArray:
    """Standard deviation of declination: sqrt(0.26^2 + (5417 / H)^2) degrees, H in nanotesla.

    It covers crust and disturbance field on the open earth, not iron and current nearby. The figures are those of the
    2025 model, taken for its predecessors too: theirs differ by 4 %.

    Source: The US/UK World Magnetic Model for 2025-2030, NOAA technical report 2024, error model.

    Examples
    --------
    >>> round(float(declination_sigma_deg(np.array(18000.0))), 3)
    0.398
    """
    return np.asarray(np.hypot(SIGMA_FLOOR_DEG, SIGMA_SLOPE_DEG_NT / np.asarray(horizontal_nt, dtype=np.float64)))


def declination_along(
    latitude_deg: FloatArray, longitude_deg: FloatArray, altitude_m: FloatArray, utc_ns: int
) -> Declination:
    """Declination along a track.

    The model (0.2 ms a call) is evaluated every 5 km of path and interpolated in between, along the shorter arc: an
    error below 0.01 deg but for the surroundings of the magnetic poles, where a heading is useless anyway.

    Parameters
    ----------
    latitude_deg, longitude_deg, altitude_m : ndarray, shape (n,)
        Positions in order of time; NaN where unknown (an unknown altitude is taken as 0).
    utc_ns : int
        Date, UTC nanoseconds since 1970.

    Raises
    ------
    NotAssessableError
        When no model serves the date.
    """
    model, year = _model_of(utc_ns)
    known = np.flatnonzero(np.isfinite(latitude_deg) & np.isfinite(longitude_deg))
    values, horizontal, down = np.full((3, len(latitude_deg)), np.nan)
    if known.size:
        path = _path_m(latitude_deg[known], longitude_deg[known])
        knot = np.flatnonzero(np.diff(path // KNOT_SPACING_M, prepend=-1.0, append=-1.0)[:-1])
        knot = np.unique(np.append(knot, len(known) - 1))
        altitude_km = np.nan_to_num(altitude_m[known[knot]], nan=0.0) / 1000.0
        fields = [
            model.calculate(glat=float(latitude), glon=float(longitude), alt=float(altitude), time=year)
            for latitude, longitude, altitude in zip(
                latitude_deg[known[knot]], longitude_deg[known[knot]], altitude_km, strict=True
            )
        ]
        continuous = unwrap(np.array([field.d for field in fields]))
        values[known] = wrap_180(np.interp(path, path[knot], continuous))
        horizontal[known] = np.interp(path, path[knot], [field.h for field in fields])
        down[known] = np.interp(path, path[knot], [field.z for field in fields])
    return Declination(values, horizontal, down, str(model.model))


def _path_m(latitude_deg: FloatArray, longitude_deg: FloatArray) -> FloatArray:
    """Distance along a track, shape (n,), good to 1 %: it only spaces the knots."""
    north_m = np.diff(latitude_deg) * M_PER_DEG
    east_m = wrap_180(np.diff(longitude_deg)) * M_PER_DEG * np.cos(np.deg2rad(latitude_deg[1:]))
    return np.concatenate([[0.0], np.cumsum(np.hypot(north_m, east_m))])


def _model_of(utc_ns: int) -> tuple[Any, float]:
    """The model that serves a date, and the date as a decimal year."""
    moment = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=utc_ns // 1000)
    base_year = moment.year // 5 * 5
    if base_year not in MODEL_YEARS:
        raise NotAssessableError(
            "magnetic declination",
            f"a flight of {utc_ns_to_iso(utc_ns, 0)[:10]}",
            f"a date the world magnetic models serve, {MODEL_YEARS[0]} to {MODEL_YEARS[-1] + 4}",
            "check the date of the log, or log the variation",
        )
    from pygeomag import GeoMag

    start, end = datetime(moment.year, 1, 1, tzinfo=UTC), datetime(moment.year + 1, 1, 1, tzinfo=UTC)
    return GeoMag(base_year=base_year), moment.year + (moment - start) / (end - start)
