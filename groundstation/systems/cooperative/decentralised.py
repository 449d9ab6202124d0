"""Decentralised filters: every vehicle estimates its own states alone.

It hears what its neighbours broadcast. Four algorithms differ in what they make of a neighbour's estimate:

- ``neighbour_exact``: it is the truth.
- ``ranked``: only neighbours of a higher rank are used, and h P h' of their covariance is added to the noise.
- ``modified``: ranked, all ranges of a frame together; the noise of two neighbours is correlated by what they share:
  each keeps and broadcasts its covariance C with the errors of uncertain ground points (a consider filter), and the
  noise of neighbours a and b has the covariance h_a C_a Pc^-1 C_b' h_b'.
- ``split_intersection``: a covariance has an independent part and one that may be correlated with anything; the latter
  is fused by covariance intersection. All that was ever broadcast counts as correlated, and so does all that is heard:
  others have heard it too. What gathers between two transmissions is independent. Consistent whatever the correlation.

Source: Skrypnik, Inter-aircraft navigation in air traffic management, 2010, chapters 3 and 4 (the first three);
Schmidt, Application of state-space methods to navigation problems, 1966 (consider states); Julier and Uhlmann, General
decentralized data fusion with covariance intersection, 2001 (split form); Li and Nashashibi, Cooperative multi-vehicle
localization using split covariance intersection filter, 2013, equations 10 to 14.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.methods.link_dynamics import ROOMS
from groundstation.systems.cooperative.alone import run_alone
from groundstation.systems.cooperative.alone_types import (
    EXACT,
    MODIFIED,
    NOBODY,
    RANKED,
    SPLIT,
    AloneWorkspace,
    HeardBroadcasts,
    NeighbourRules,
    OwnFilters,
    Past,
    UpdateRows,
)
from groundstation.systems.cooperative.error_map import blocks, spectral_radius, unit_rows, windows
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import Items, RunRecords, rows_for
from groundstation.systems.cooperative.messages import Broadcast
from groundstation.systems.cooperative.plain.split_covariance import WEIGHTS
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.timeline import timeline
from groundstation.systems.cooperative.tracks import AlgorithmRun, counted, finished, log_for
from groundstation.tables.session import NO_SLOT

NUMBERS = {"neighbour_exact": EXACT, "ranked": RANKED, "modified": MODIFIED, "split_intersection": SPLIT}


def run_decentralised(prepared: Prepared, settings: CooperativeSettings, algorithm: str) -> AlgorithmRun:
    """Run one of the four decentralised algorithms."""
    together = settings.update == "simultaneous" or algorithm == "modified"
    items = timeline(prepared, settings, together=together)
    log = log_for(prepared, items)
    radius = _work(prepared, settings, algorithm, items, log)
    messages = counted(prepared, log.sent, _message_bytes(prepared, algorithm))
    return finished(prepared, items, log, algorithm, "simultaneous" if together else "sequential", messages, radius)


def _work(
    prepared: Prepared, settings: CooperativeSettings, algorithm: str, items: Items, log: RunRecords
) -> tuple[list[float], list[float]]:
    """Run the loop window by window; in between the error map is judged and begun anew.

    Errors of messages under way count as those of their senders at the beginning of the window.
    """
    fleet, unit = prepared.fleet, unit_rows(prepared.fleet, settings.map_window_s)
    variance = np.repeat(prepared.points.sigma_m[prepared.points.uncertain >= 0] ** 2, 2)
    ranks = np.array(prepared.ranks, dtype=np.int64)
    method = NeighbourRules(NUMBERS[algorithm], settings.gate_sigma, ranks, variance, WEIGHTS)
    own = _start(prepared, unit, len(variance))
    k, n, width = unit.shape
    past = _past(own, settings.latency_slots + 1)
    most = max(int((items.last - items.first).max(initial=0)), 1)
    heard = _heard(own, most + k + 1)
    batch, room = _batch(most, n, len(variance)), _room(most, n, len(variance), width)
    rows, rejected = rows_for(n), np.zeros(k, dtype=np.int64)
    times: list[float] = []
    radii: list[float] = []
    for begin, end in windows(items, settings.map_window_s):
        if begin > 0:
            times.append(float(items.time_s[begin]))
            radii.append(spectral_radius(blocks(own.map_rows, fleet)))
        own.map_rows[:] = unit
        past.begun[0] = 0
        heard.slot[:] = NO_SLOT
        run_alone(
            fleet,
            prepared.points,
            prepared.events,
            items,
            begin,
            end,
            method,
            own,
            past,
            heard,
            rejected,
            batch,
            room,
            rows,
            log,
        )
    return times, radii


def _start(prepared: Prepared, unit: FloatArray, errors: int) -> OwnFilters:
    k, n, _ = unit.shape
    own = OwnFilters(
        np.array([vehicle.first_s for vehicle in prepared.vehicles]),
        np.zeros((k, n)),
        np.zeros((k, n, n)),
        np.zeros((k, n, n)),
        np.zeros((k, n, errors)),
        unit.copy(),
    )
    for who, vehicle in enumerate(prepared.vehicles):
        size = vehicle.size
        own.x[who, :size], own.P[who, :size, :size] = vehicle.start()
    own.independent[:] = own.P
    return own


def _past(own: OwnFilters, slots: int) -> Past:
    def room(like: FloatArray) -> FloatArray:
        return np.zeros((slots, *like.shape))

    return Past(
        np.full(slots, NO_SLOT, dtype=np.int64),
        np.zeros(1, dtype=np.int64),
        room(own.time_s),
        room(own.x),
        room(own.P),
        room(own.shared),
        room(own.map_rows),
    )


def _heard(own: OwnFilters, entries: int) -> HeardBroadcasts:
    k, n, width = own.map_rows.shape
    return HeardBroadcasts(
        np.zeros((entries, 3)),
        np.zeros(entries),
        np.zeros((entries, 4, 4)),
        np.zeros((entries, 4, own.shared.shape[2])),
        np.zeros((entries, 4, n)),
        np.zeros((entries, n, width)),
        np.full(entries, NOBODY, dtype=np.int64),
        np.zeros(1, dtype=np.int64),
        np.zeros(k, dtype=np.int64),
        np.full(k, NO_SLOT, dtype=np.int64),
    )


def _batch(most: int, n: int, errors: int) -> UpdateRows:
    return UpdateRows(
        np.zeros(most, dtype=np.int64),
        np.zeros(most, dtype=np.int64),
        np.zeros((most, n)),
        np.zeros((most, errors)),
        np.zeros((most, 4)),
        np.zeros(most),
        np.zeros(most),
        np.zeros(most),
    )


def _room(most: int, n: int, errors: int, width: int) -> AloneWorkspace:
    return AloneWorkspace(
        np.zeros((n, n)),
        np.zeros((n, n)),
        np.zeros((ROOMS, n, n)),
        np.zeros(n),
        np.zeros(3),
        np.zeros((3, n)),
        np.zeros(3),
        np.zeros((n, errors)),
        np.zeros((n, n)),
        np.zeros((n, max(width, errors))),
        np.zeros((most, most)),
        np.zeros((most, most)),
        np.zeros((most, n)),
        np.zeros((most, n)),
        np.zeros((most, width)),
        np.zeros((most, errors)),
        np.zeros((5, 4, 4)),
        np.zeros(most, dtype=np.int64),
        np.zeros((2, max(most, n))),
    )


def _message_bytes(prepared: Prepared, algorithm: str) -> int:
    """Size of a broadcast, as ``messages`` packs it."""
    covariance = None if algorithm == "neighbour_exact" else np.zeros((4, 4))
    uncertain = int((prepared.points.sigma_m > 0.0).sum())
    shared = np.zeros((4, 2 * uncertain)) if algorithm == "modified" else None
    return len(Broadcast(0, 0, 0, np.zeros(3), 0.0, covariance, shared).encode())
