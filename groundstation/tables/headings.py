"""True heading of a flight: logged, or magnetic heading with declination."""

import numpy as np

from groundstation.base.angles import FloatArray, unwrap, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import declination_along
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import frozen
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.tables.table import Flight, Table

FARTHEST_POSITION_S = 600.0  # an aircraft covers 150 km in that time: some tenths of a degree of declination


@dataclass(frozen=True)
class TrueHeading:
    """True heading at the samples of an inertial topic.

    Parameters
    ----------
    values_deg : ndarray, shape (n,)
        Nose, clockwise from true north, in [0, 360); NaN where unknown.
    description : str
        Where it comes from, for the report.
    declination_sigma_deg : float or None
        Standard deviation of the declination in it, one error common to all samples; None when it was logged as true.
    """

    values_deg: FloatArray
    description: str
    declination_sigma_deg: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "values_deg", frozen(self.values_deg))


def true_from_magnetic(magnetic_heading_deg: FloatArray, declination_deg: FloatArray) -> FloatArray:
    """True heading in [0, 360): magnetic heading + declination, east positive.

    Examples
    --------
    Where the needle points 11 deg east of true north, a nose at 355 deg magnetic is at 6 deg true:

    >>> float(true_from_magnetic(np.array(355.0), np.array(11.0)))
    6.0
    """
    return wrap_360(np.asarray(magnetic_heading_deg) + np.asarray(declination_deg))


def true_heading(flight: Flight, ins_topic: str = "ins") -> TrueHeading:
    """True heading of an inertial unit, as logged or from its magnetic heading.

    Logged true heading comes first; what a reader derived it from (metadata ``derived.<topic>.true_heading_deg``) is
    repeated in the description. Else declination of the world magnetic model is added to the magnetic heading, at the
    unit's own position or that of the satellite receiver, at most ten minutes away. Validity flags are not looked at.

    Raises
    ------
    NotAssessableError
        No such topic, no heading, or no declination (no date, no position, a date no model serves).
    """
    if ins_topic not in flight or not len(flight[ins_topic]):
        raise NotAssessableError("heading", f"no samples of {ins_topic}")
    table = flight[ins_topic]
    true_deg = table.values("true_heading_deg")
    if np.isfinite(true_deg).any():
        origin = flight.metadata.get(f"derived.{ins_topic}.true_heading_deg", "")
        description = f"true heading, which the reader derived from {origin}" if origin else "true heading as logged"
        return TrueHeading(np.where(np.isfinite(true_deg), wrap_360(true_deg), np.nan), description)
    magnetic_deg = table.values("magnetic_heading_deg")
    if not np.isfinite(magnetic_deg).any():
        raise NotAssessableError("heading", f"{ins_topic} has neither true nor magnetic heading")
    return _from_magnetic(flight, table, magnetic_deg)


def _from_magnetic(flight: Flight, table: Table, magnetic_deg: FloatArray) -> TrueHeading:
    if not flight.has_utc:
        raise NotAssessableError(
            "heading", "magnetic heading in a log without date", "true heading, or a date for the declination"
        )
    source = positions_for(flight, table)
    altitude = source.values("altitude_ellipsoid_m")
    altitude = np.where(np.isfinite(altitude), altitude, source.values("altitude_msl_m"))
    along = declination_along(
        source.values("latitude_deg"), source.values("longitude_deg"), altitude, int(flight.start_ns)
    )
    declination = _carried_over(table, source, along.values_deg)
    known = np.isfinite(declination) & np.isfinite(magnetic_deg)
    if not known.any():
        raise NotAssessableError("heading", "no position within 10 minutes of the magnetic heading")
    used = declination[known]
    sigma = float(np.median(along.sigma_deg[np.isfinite(along.sigma_deg)]))
    return TrueHeading(
        true_from_magnetic(np.where(known, magnetic_deg, np.nan), declination),
        f"magnetic heading + declination of {along.model} at the position of {source.topic}: "
        f"{np.min(used):+.2f} to {np.max(used):+.2f} deg, sigma {sigma:.2f} deg",
        sigma,
    )


def positions_for(flight: Flight, table: Table) -> Table:
    """Samples with a position, of the unit itself or else of a satellite receiver.

    Raises
    ------
    NotAssessableError
        When there is none.
    """
    for candidate in (table, *(flight[topic] for topic in topics_of_kind("gnss", flight.topics()))):
        known = candidate.valid("latitude_deg", "longitude_deg")
        if known.any():
            return candidate.take(known)
    raise NotAssessableError("heading", "magnetic heading without any position", "a position for the declination")


def _carried_over(table: Table, source: Table, declination_deg: FloatArray) -> FloatArray:
    """Interpolate the declination to the times of a table.

    Past the ends of the positions the nearest one is held.
    """
    time_s = (table.time_ns - source.time_ns[0]) / NS_PER_S
    source_s = (source.time_ns - source.time_ns[0]) / NS_PER_S
    value = wrap_180(np.interp(time_s, source_s, unwrap(declination_deg)))
    after = np.searchsorted(source_s, time_s).clip(0, len(source_s) - 1)
    before = np.maximum(after - 1, 0)
    distance_s = np.minimum(np.abs(source_s[after] - time_s), np.abs(source_s[before] - time_s))
    return np.where(distance_s <= FARTHEST_POSITION_S, value, np.nan)
