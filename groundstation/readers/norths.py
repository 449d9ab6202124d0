"""North of a logged track and sign of a logged variation, found from the data.

Recorders of one family differ: a Garmin G1000 logs a magnetic track and a variation that is positive east, a G3X a true
track and a variation that is positive west, a G5 either, depending on its software. Velocities or positions beside the
track show which it is; the Earth's field of the day shows the rest.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, direction_of, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import declination_along
from groundstation.base.errors import NotAssessableError
from groundstation.base.geodesy import SEMI_MAJOR_M, has_position
from groundstation.readers.dialect import Dialect
from groundstation.readers.layout import TableLayout
from groundstation.readers.sections import TableSection
from groundstation.readers.source import Source

LOOKED_AT = "looked_at"  # topic of columns that are read for what they show
OF_MOTION = (
    *("latitude_deg", "longitude_deg", "track_deg", "ground_speed_mps"),
    *("velocity_east_mps", "velocity_north_mps"),
)
LEAST_VARIATION_DEG = 1.0  # below it neither north nor sign makes a difference that could be seen
_MOVING_MPS, _MOVED_M = 5.0, 30.0
_FEWEST, _ENOUGH = 20, 200  # samples
_SHARE = 0.4  # largest misfit, as a share of the variation: the ways to read a track differ by all of it
_WINDOWS, _WINDOW_BYTES = (0.5, 0.75, 0.25, 0.0), 128 << 10  # places among the rows where motion is looked for
_APART = 2  # rows to either side, between which a position has moved
_PLACES = 5  # places where the Earth's field is computed
_FIELD_MISFIT_DEG, _FIELD_MARGIN_DEG = 2.5, 1.0  # tables of recorders are years old


@dataclass(frozen=True)
class NorthSamples:
    """Some rows of a log, shape (n,) each; NaN where a row has no value."""

    track_deg: FloatArray
    variation_deg: FloatArray
    velocity_east_mps: FloatArray
    velocity_north_mps: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray

    @property
    def has_variation(self) -> bool:
        """Tell whether the variation differs from zero in most rows."""
        known = np.abs(self.variation_deg[np.isfinite(self.variation_deg)])
        return bool(len(known) and np.median(known) >= LEAST_VARIATION_DEG)


@dataclass(frozen=True)
class Norths:
    """Findings from the data of a log, on its track and its variation.

    Parameters
    ----------
    track : {'', 'true', 'magnetic'}
    sign : {0, 1, -1}
        1 where the variation is positive east.
    track_by, sign_by : str
        What showed them.
    has_variation : bool
        The variation is more than next to nothing: a zero is what the recorder writes before it knows it.
    """

    track: str = ""
    sign: int = 0
    track_by: str = ""
    sign_by: str = ""
    has_variation: bool = False


def samples_of(source: Source, dialect: Dialect, layout: TableLayout) -> NorthSamples:
    """Read rows from the middle of a file, or from elsewhere where nothing moves there.

    All rows of a small file are read.

    ``layout`` has fields of :data:`OF_MOTION` and ``variation_deg`` under the topic :data:`LOOKED_AT`.
    """
    from groundstation.readers.table_reader import TableReader

    parts: list[dict[str, FloatArray]] = []
    for window in _windows(source, dialect):
        for columns in TableReader(source, [TableSection(window, layout)]).columns():
            parts.append({name: np.where(one.mask, one.values, np.nan) for (_topic, name), one in columns.items()})
        if _is_enough(parts):
            break
    none = np.full(sum(len(part["variation_deg"]) for part in parts), np.nan)
    names = {name for part in parts for name in part}
    joined = {name: np.concatenate([part[name] for part in parts]) for name in names}
    return NorthSamples(
        joined.get("track_deg", none),
        joined.get("variation_deg", none),
        joined.get("velocity_east_mps", none),
        joined.get("velocity_north_mps", none),
        joined.get("latitude_deg", none),
        joined.get("longitude_deg", none),
    )


def day_of(source: Source, dialect: Dialect, layout: TableLayout) -> int | None:
    """Return the time of one row, device nanoseconds; None where no row has one."""
    from groundstation.readers.table_reader import first_times

    for window in _windows(source, dialect):
        times, _zoneless = first_times(source, window, layout)
        if times.mask.any():
            return int(times.values[times.mask][0])
    return None


def _windows(source: Source, dialect: Dialect) -> Iterator[Dialect]:
    first, end = dialect.first_byte, source.size if dialect.end_byte is None else dialect.end_byte
    if end - first <= len(_WINDOWS) * _WINDOW_BYTES:
        yield replace(dialect, end_byte=end)
        return
    for share in _WINDOWS:
        start = first + int(share * (end - first))
        if share:
            with source.open() as stream:
                stream.seek(start)
                start += stream.read(_WINDOW_BYTES).find(b"\n") + 1
        yield replace(dialect, first_byte=start, end_byte=min(start + _WINDOW_BYTES, end))


def _is_enough(parts: Sequence[Mapping[str, FloatArray]]) -> bool:
    """Tell whether enough rows move, or the variation is close to zero."""
    variation = np.concatenate([part["variation_deg"] for part in parts] or [np.zeros(0)])
    speed = np.concatenate([part.get("ground_speed_mps", np.zeros(0)) for part in parts] or [np.zeros(0)])
    known = np.abs(variation[np.isfinite(variation)])
    with np.errstate(invalid="ignore"):
        return int((speed > _MOVING_MPS).sum()) >= _ENOUGH or bool(len(known) and known.max() < LEAST_VARIATION_DEG)


def by_motion(samples: NorthSamples) -> Norths:
    """Find the north of the track by the motion, and the sign of its variation if magnetic.

    Examples
    --------
    >>> one, none = np.ones(30), np.full(30, np.nan)
    >>> found = by_motion(NorthSamples(77.0 * one, 13.0 * one, 12.0 * one, 0.0 * one, none, none))  # it flies east
    >>> found.track, found.sign, found.track_by
    ('magnetic', 1, 'velocities')
    """
    moves = {
        "velocities": np.stack([samples.velocity_north_mps, samples.velocity_east_mps]) / _MOVING_MPS,
        "positions": _moved_m(samples) / _MOVED_M,
    }
    for by, (north, east) in moves.items():
        with np.errstate(invalid="ignore"):
            usable = (np.hypot(north, east) > 1.0) & np.isfinite(samples.track_deg)
            usable &= np.abs(samples.variation_deg) >= LEAST_VARIATION_DEG
        if usable.sum() < _FEWEST:
            continue
        off = wrap_180(direction_of(north[usable], east[usable]) - samples.track_deg[usable])
        variation = samples.variation_deg[usable]
        ways = {("true", 0): 0.0, ("magnetic", 1): 1.0, ("magnetic", -1): -1.0}
        misfits = {way: float(np.median(np.abs(wrap_180(off - sign * variation)))) for way, sign in ways.items()}
        best = min(misfits, key=lambda way: misfits[way])
        if misfits[best] < _SHARE * float(np.median(np.abs(variation))):
            return Norths(*best, by, by)
    return Norths()


def _moved_m(samples: NorthSamples) -> FloatArray:
    """Return the way north and east around each row, metres, shape (2, n)."""
    moved = np.full((2, len(samples.track_deg)), np.nan)
    known = np.flatnonzero(has_position(samples.latitude_deg, samples.longitude_deg))
    if len(known) > 2 * _APART:
        latitude, longitude = samples.latitude_deg[known], samples.longitude_deg[known]
        rows = known[_APART:-_APART]
        moved[0, rows] = latitude[2 * _APART :] - latitude[: -2 * _APART]
        moved[1, rows] = wrap_180(longitude[2 * _APART :] - longitude[: -2 * _APART])
        moved[1, rows] *= np.cos(np.deg2rad(latitude[_APART:-_APART]))
    return np.asarray(np.deg2rad(moved) * SEMI_MAJOR_M)


def by_the_field(samples: NorthSamples, utc_ns: int) -> Norths:
    """Find the sign of the variation by the Earth's field at some of the positions."""
    with np.errstate(invalid="ignore"):
        usable = has_position(samples.latitude_deg, samples.longitude_deg)
        usable &= np.abs(samples.variation_deg) >= LEAST_VARIATION_DEG
    places = np.flatnonzero(usable)
    if not len(places):
        return Norths()
    places = places[np.unique(np.linspace(0, len(places) - 1, _PLACES).astype(int))]
    try:
        field = declination_along(
            samples.latitude_deg[places],
            samples.longitude_deg[places],
            np.full(len(places), np.nan),
            utc_ns,
        )
    except NotAssessableError:
        return Norths()
    variation = samples.variation_deg[places]
    misfits = {sign: float(np.median(np.abs(wrap_180(sign * variation - field.values_deg)))) for sign in (1, -1)}
    best = min(misfits, key=lambda sign: misfits[sign])
    is_clear = misfits[best] < _FIELD_MISFIT_DEG and misfits[-best] > misfits[best] + _FIELD_MARGIN_DEG
    return Norths(sign=best, sign_by=f"the declination of {field.model}") if is_clear else Norths()
