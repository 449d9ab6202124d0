"""Rows of one receiver as arrays: places, velocities, states, time each row stands for."""

from dataclasses import replace
from fnmatch import fnmatchcase
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.gaps import logged_ns
from groundstation.base.geodesy import SEMI_MAJOR_M, curvature_radii_m, on_earth
from groundstation.base.nearest import nearest_rows
from groundstation.base.records import BoolArray, Column
from groundstation.base.signals import topics_of_kind
from groundstation.systems.gnss.answer import WITHOUT_FIX
from groundstation.systems.gnss.settings import GnssSettings
from groundstation.tables.gaps import largest_step_s
from groundstation.tables.motion import runs
from groundstation.tables.table import Flight, Table

ROUNDING_S = 1e-6  # of flight seconds: a step of exactly the limit is no gap
BURSTS, BURST_QUANTILE = 1.5, 0.9  # a step longer than most by so much is a gap
REGULAR_SHARE, REGULAR_STEP = 0.8, 0.2  # steps within so much of the usual one make epochs that can be missed
FIX_WITHOUT_INTEGRITY = ("none", "2d", "dead_reckoning", "other")  # of which a receiver never vouches


@dataclass(frozen=True)
class ReceiverRows:
    """Rows of a receiver, one for each time.

    Parameters
    ----------
    topic : str
    table : Table
    rows : int
        Rows as logged.
    time_s : ndarray, shape (n,)
        Flight seconds.
    latitude_deg, longitude_deg, up_m : ndarray, shape (n,)
        Its places; NaN where there is none. Heights are above the ellipsoid where that is logged, else above the sea.
    velocity_mps : ndarray, shape (n, 3)
        North, east, up.
    speed_mps : ndarray, shape (n,)
        Horizontal.
    state : ndarray of str, shape (n,)
        Keys of ``answer.STATE_NAMES``.
    step_s, gap_s : float
        Usual step, and the longest that is no gap; NaN and infinity of a single row.
    held_s : ndarray, shape (n,)
        Seconds that each row stands for.
    paused_s : ndarray, shape (k, 2)
        Pauses of the log between the first row and the last: from and to, flight seconds.
    steps_s : ndarray, shape (n - 1,)
        Logged seconds from each row to the next, pauses left out.
    hdop_of : str
        NMEA topic that the HDOP of the table comes from; empty where it is a field of its rows.
    """

    topic: str
    table: Table
    rows: int
    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    up_m: FloatArray
    velocity_mps: FloatArray
    speed_mps: FloatArray
    state: NDArray[np.str_]
    step_s: float
    gap_s: float
    held_s: FloatArray
    paused_s: FloatArray
    steps_s: FloatArray
    hdop_of: str = ""

    @property
    def placeless(self) -> int:
        """Number of rows that claim a fix without a place or a velocity."""
        claims = ~np.isin(self.table.text("fix"), ("", "none"))
        return int(np.count_nonzero(claims & (self.state == "none")))

    @property
    def resolution_m(self) -> float:
        """Smallest change of a latitude, metres: the step in which places are logged."""
        steps = np.abs(np.diff(self.latitude_deg))
        steps = steps[steps > 1e-12]
        return float(np.deg2rad(steps.min()) * SEMI_MAJOR_M) if steps.size else 0.0

    @property
    def has_fix(self) -> BoolArray:
        """Tell which rows have a fix."""
        return ~np.isin(self.state, WITHOUT_FIX)

    def values(self, name: str) -> FloatArray:
        """Values of a field, NaN where it is absent or a row has no fix."""
        return np.where(self.has_fix, self.table.values(name), np.nan)

    def plan_m(self, rows: NDArray[np.intp], latitude_deg: FloatArray, longitude_deg: FloatArray) -> FloatArray:
        """Return north and east of some rows from places of their own, shape (k, 2)."""
        meridian, prime_vertical = curvature_radii_m(latitude_deg)
        north = np.deg2rad(self.latitude_deg[rows] - latitude_deg) * meridian
        east = np.deg2rad(wrap_180(self.longitude_deg[rows] - longitude_deg)) * prime_vertical
        return np.column_stack([north, east * np.cos(np.deg2rad(latitude_deg))])

    @cached_property
    def is_gap(self) -> BoolArray:
        """Tell behind which rows there is a gap or a pause of the log, shape (n - 1,).

        A row that is late, and those behind it catch up, is none: nothing is missing.
        """
        is_long, missing = self.steps_s > self.gap_s, self.missing
        if missing is not None:
            is_long &= missing > 0
        return is_long | (np.diff(self.time_s) > self.steps_s + ROUNDING_S)

    @cached_property
    def missing(self) -> NDArray[np.intp] | None:
        """Epochs that are missing behind each row but the last, shape (n - 1,).

        A row that is late, and whose neighbours catch up, misses none. None where the rate is not regular.
        """
        beyond = self.steps_s / self.step_s - 1.0
        is_odd = np.abs(beyond) > REGULAR_STEP
        if not len(beyond) or np.mean(~is_odd) < REGULAR_SHARE:
            return None
        wide = np.pad(is_odd, 1)
        wide = wide[:-2] | wide[1:-1] | wide[2:]  # with a neighbour on each side
        alone = np.maximum(np.round(beyond), 0.0)
        missing = np.zeros(len(beyond), dtype=np.intp)
        for first, behind in runs(wide):
            mine = alone[first:behind]
            left = np.round(beyond[first:behind].sum()) - (np.cumsum(mine) - mine)
            missing[first:behind] = np.clip(left, 0.0, mine)
        return missing

    @property
    def missed(self) -> int | None:
        """Epochs that are missing between the first and the last row.

        None where the rate is not regular.
        """
        missing = self.missing
        return None if missing is None else int(missing.sum())


def series_of(flight: Flight, topic: str, settings: GnssSettings) -> ReceiverRows:
    """Return the rows of a receiver.

    Repeated times are one row, with the first value of each field.
    """
    table, hdop_of = _with_hdop(flight, flight[topic].unique_times())
    time_s = flight.seconds(table.time_ns)
    steps = np.diff(flight.seconds(logged_ns(table.time_ns, flight.pauses)))
    step_s = float(np.median(steps)) if len(steps) else np.nan
    gap_s = largest_step_s(table.time_ns, settings.gap_steps, settings.gap_min_s) + ROUNDING_S
    most_s = float(np.quantile(steps, BURST_QUANTILE)) if len(steps) else 0.0
    if most_s > gap_s:  # rows come in bursts
        gap_s = BURSTS * most_s
    usual_s = step_s if np.isfinite(step_s) else 0.0
    paused_s = flight.seconds(np.array(flight.pauses, dtype=np.int64).reshape(-1, 2))
    paused_s = paused_s[(paused_s[:, 0] < time_s[-1]) & (paused_s[:, 1] > time_s[0])]
    is_short = np.diff(time_s) <= steps + 1e-6  # no pause in it
    held_s = np.append(np.where(is_short & (steps <= gap_s), steps, np.minimum(steps, usual_s)), usual_s)
    velocity = np.column_stack([table.values(f"velocity_{axis}_mps") for axis in ("north", "east", "down")])
    velocity[:, 2] *= -1.0
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    speed = np.where(np.isfinite(speed), speed, table.values("ground_speed_mps"))
    latitude, longitude = on_earth(table.values("latitude_deg"), table.values("longitude_deg"))
    name = "altitude_ellipsoid_m" if table.has("altitude_ellipsoid_m") else "altitude_msl_m"
    return ReceiverRows(
        topic,
        table,
        len(flight[topic]),
        time_s,
        latitude,
        longitude,
        table.values(name),
        velocity,
        speed,
        _states(table, np.isfinite(latitude + longitude) | np.isfinite(speed)),
        step_s,
        gap_s,
        held_s,
        paused_s,
        steps,
        hdop_of,
    )


def _with_hdop(flight: Flight, table: Table) -> tuple[Table, str]:
    """Return rows with the HDOP of NMEA sentences where they have none, and its topic.

    Of a log with several receivers nothing says whose sentences they are.
    """
    if len(topics_of_kind("gnss", flight.topics())) > 1 or np.isfinite(table.values("hdop")).any() or len(table) < 2:
        return table, ""
    for topic in sorted(flight.topics(), key=lambda name: (not name.endswith("GGA"), name)):
        if not fnmatchcase(topic, "raw.[GB]?GGA") and not fnmatchcase(topic, "raw.[GB]?GSA"):
            continue
        values = flight[topic].values("HDOP")
        known = np.flatnonzero(np.isfinite(values) & (values > 0.0))
        if not known.size:
            continue
        time_ns = flight[topic].time_ns[known]
        nearest = nearest_rows(time_ns, table.time_ns)
        near = np.abs(time_ns[nearest] - table.time_ns) <= 0.5 * np.median(np.diff(table.time_ns))
        hdop = np.where(near, values[known][nearest], np.nan)
        if near.any() and not _is_pdop(hdop, table.values("pdop")):
            return replace(table, columns={**table.columns, "hdop": Column(hdop, near)}), topic
    return table, ""


def _is_pdop(hdop: FloatArray, pdop: FloatArray) -> bool:
    """Tell whether what a sentence calls HDOP is the PDOP, which is always larger."""
    known = np.isfinite(hdop) & np.isfinite(pdop)
    return bool(known.any() and np.median(hdop[known] - pdop[known]) >= 0.0)


def _states(table: Table, has_any: BoolArray) -> NDArray[np.str_]:
    """Return the state of each row.

    A fix that is claimed without a place and without a velocity is none: a receiver without a fix may leave latitude
    and longitude 0 beside it.
    """
    claimed = table.text("fix").astype("<U16")
    state = np.where(claimed != "", claimed, "fix")
    state[~has_any] = "none"
    is_doubted = (table.values("integrity_ok") == 0.0) & ~np.isin(state, FIX_WITHOUT_INTEGRITY)
    state[is_doubted] = "integrity_lost"
    return state
