"""Arrays handed to the loop of the filters of vehicles that estimate alone. No numba here."""

from typing import NamedTuple

from groundstation.base.records import Int64Array
from groundstation.systems.cooperative.loop_types import FloatArray

EXACT, RANKED, MODIFIED, SPLIT = 0, 1, 2, 3
NOBODY = -1


class OwnFilters(NamedTuple):
    """Filters of k vehicles: at most n states each, q errors of uncertain points; N states."""

    time_s: FloatArray  # (k,)
    x: FloatArray  # (k, n)
    P: FloatArray  # (k, n, n)
    independent: FloatArray  # (k, n, n) part of P that nobody else can know (split)
    shared: FloatArray  # (k, n, q) covariance with the points (modified)
    map_rows: FloatArray  # (k, n, N) rows of the error map


class Past(NamedTuple):
    """Past states of all filters, at the beginning of the last slots, oldest first."""

    slot: Int64Array  # (slots,)
    begun: Int64Array  # (1,) how many slots have begun
    time_s: FloatArray  # (slots, k)
    x: FloatArray
    P: FloatArray
    shared: FloatArray
    map_rows: FloatArray


class HeardBroadcasts(NamedTuple):
    """Broadcasts heard by the measurements of a group.

    The last of each sender is kept for those who hear it next.
    """

    place_m: FloatArray  # (h, 3)
    clock_m: FloatArray  # (h,)
    covariance: FloatArray  # (h, 4, 4) of place and clock, as 4-byte numbers
    shared: FloatArray  # (h, 4, q) the same
    told: FloatArray  # (h, 4, n) derivative of place and clock by the sender's state, for the error map alone
    map_rows: FloatArray  # (h, n, N) the same
    owner: Int64Array  # (h,) sender
    newest: Int64Array  # (1,) entry
    of: Int64Array  # (k,) entry of each sender's last broadcast
    slot: Int64Array  # (k,) slot of that broadcast; NO_SLOT: none


class NeighbourRules(NamedTuple):
    """Settings of how a filter uses its neighbours."""

    algorithm: int
    gate_sigma: float
    ranks: Int64Array  # (k,)
    point_variance: FloatArray  # (q,)
    weights: FloatArray  # of covariance intersection


class UpdateRows(NamedTuple):
    """Rows of one update of one vehicle, at most r."""

    event: Int64Array
    heard: Int64Array  # entry of HeardBroadcasts, NOBODY for a point or satellite
    h: FloatArray  # (r, n) by its state now
    by_shared: FloatArray  # (r, q)
    told: FloatArray  # (r, 4) by place and clock of the source
    innovation: FloatArray
    own: FloatArray  # variance of the sensor
    brought: FloatArray  # variance that the source brings


class AloneWorkspace(NamedTuple):
    """Work arrays of the loop."""

    phi: FloatArray  # (n, n)
    noise: FloatArray
    step: FloatArray  # (ROOMS, n, n)
    x: FloatArray  # (n,)
    reading: FloatArray  # (3,)
    derivative: FloatArray  # (3, n)
    source: FloatArray  # (3,)
    held: FloatArray  # (n, q)
    P: FloatArray  # (n, n)
    wide: FloatArray  # (n, N) or wider than q
    S: FloatArray  # (r, r)
    kept: FloatArray  # (r, r)
    right: FloatArray  # (r, n)
    gain: FloatArray  # (r, n)
    mixed: FloatArray  # (r, N)
    by_error: FloatArray  # (r, q)
    cross: FloatArray  # (5, 4, 4)
    entry: Int64Array  # (r,) of HeardBroadcasts, for each measurement of a group
    lines: FloatArray  # (2, n or r)
