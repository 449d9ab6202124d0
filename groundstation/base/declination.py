"""Magnetic declination along a flight, from the world magnetic model of its date.

Before the first world magnetic model the IGRF is used.
"""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray, unwrap, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.geodesy import SEMI_MAJOR_M
from groundstation.base.records import frozen
from groundstation.base.timescales import utc_ns_to_iso

MODEL_YEARS = range(2010, 2030, 5)  # base years of the sets that pygeomag brings; each serves five years
IGRF, IGRF_FIRST_YEAR = "IGRF-14", 1970  # the reference field goes back to 1900, recorders do not
POLE_DEG = 89.99  # nearer to a pole than that east and north are nothing
KNOT_SPACING_M = 5_000.0
M_PER_DEG = SEMI_MAJOR_M * np.pi / 180.0
SIGMA_FLOOR_DEG, SIGMA_SLOPE_DEG_NT = 0.26, 5417.0
NORTH_EAST_DOWN_SIGMA_NT = (137.0, 89.0, 141.0)  # of the 2025 model, crust and disturbance field in it
HORIZONTAL_SIGMA_NT = 133.0


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
        Name of the model: ``WMM-2020``, ``IGRF-14``.
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
    2025 model, taken for its predecessors and for the IGRF too: theirs differ by 4 %, and crust and disturbances, which
    no model holds, make most of it.

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
    error below 0.01 deg but for the surroundings of the magnetic poles, where a heading is useless anyway. Flights from
    2010 on have the world magnetic model of their five years, older ones the international geomagnetic reference field.

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

    Source: The US/UK World Magnetic Model, NOAA, 2010 to 2025, as packaged by pygeomag; Alken et al., International
    Geomagnetic Reference Field: the thirteenth generation, Earth, Planets and Space 73 (2021) 49, in its fourteenth
    generation (2024), as packaged by ppigrf.
    """
    model = _model_of(utc_ns)
    known = np.flatnonzero(np.isfinite(latitude_deg) & np.isfinite(longitude_deg))
    values, horizontal, down = np.full((3, len(latitude_deg)), np.nan)
    if known.size:
        path = _path_m(latitude_deg[known], longitude_deg[known])
        knot = np.flatnonzero(np.diff(path // KNOT_SPACING_M, prepend=-1.0, append=-1.0)[:-1])
        knot = np.unique(np.append(knot, len(known) - 1))
        altitude_km = np.nan_to_num(altitude_m[known[knot]], nan=0.0) / 1000.0
        declination, *strengths = model.field(latitude_deg[known[knot]], longitude_deg[known[knot]], altitude_km)
        values[known] = wrap_180(np.interp(path, path[knot], unwrap(declination)))
        horizontal[known], down[known] = (np.interp(path, path[knot], strength) for strength in strengths)
    return Declination(values, horizontal, down, model.name)


def _path_m(latitude_deg: FloatArray, longitude_deg: FloatArray) -> FloatArray:
    """Distance along a track, shape (n,), good to 1 %: it only spaces the knots."""
    north_m = np.diff(latitude_deg) * M_PER_DEG
    east_m = wrap_180(np.diff(longitude_deg)) * M_PER_DEG * np.cos(np.deg2rad(latitude_deg[1:]))
    return np.concatenate([[0.0], np.cumsum(np.hypot(north_m, east_m))])


class _Model(NamedTuple):
    """Magnetic model at a date.

    ``field`` takes latitude, longitude and kilometres of height, and gives declination, horizontal and down intensity.
    """

    name: str
    field: Callable[[FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]]


def _model_of(utc_ns: int) -> _Model:
    """The model that serves a date."""
    moment = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=utc_ns // 1000)
    if IGRF_FIRST_YEAR <= moment.year < MODEL_YEARS[0]:
        return _reference_field(moment)
    if moment.year // 5 * 5 in MODEL_YEARS:
        return _world_magnetic_model(moment)
    raise NotAssessableError(
        "magnetic declination",
        f"a flight of {utc_ns_to_iso(utc_ns, 0)[:10]}",
        f"a date the magnetic models serve, {IGRF_FIRST_YEAR} to {MODEL_YEARS[-1] + 4}",
        "check the date of the log, or log the variation",
    )


def _world_magnetic_model(moment: datetime) -> _Model:
    from pygeomag import GeoMag

    start, end = datetime(moment.year, 1, 1, tzinfo=UTC), datetime(moment.year + 1, 1, 1, tzinfo=UTC)
    year, model = moment.year + (moment - start) / (end - start), GeoMag(base_year=moment.year // 5 * 5)

    def field(latitude: FloatArray, longitude: FloatArray, km: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        places = zip(latitude.tolist(), longitude.tolist(), km.tolist(), strict=True)
        found = [model.calculate(glat=lat, glon=lon, alt=alt, time=year) for lat, lon, alt in places]
        declination, horizontal, down = np.array([(one.d, one.h, one.z) for one in found], dtype=np.float64).T
        return declination, horizontal, down

    return _Model(str(model.model), field)


def _reference_field(moment: datetime) -> _Model:
    from ppigrf import igrf  # imports pandas: for old flights alone

    def field(latitude: FloatArray, longitude: FloatArray, km: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        off_pole = np.clip(latitude, -POLE_DEG, POLE_DEG)
        east, north, up = (part[0] for part in igrf(longitude, off_pole, km, moment.replace(tzinfo=None)))
        return np.rad2deg(np.arctan2(east, north)), np.hypot(east, north), -up

    return _Model(IGRF, field)
