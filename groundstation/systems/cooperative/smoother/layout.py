"""Joint state of the smoother: groups of vehicles, then constants (ground points, pairs)."""

from collections.abc import Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.systems.cooperative.aircraft import Aircraft
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import PEER, POINT
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.smoother.aircraft_group import AircraftGroup
from groundstation.systems.cooperative.smoother.sight import Group
from groundstation.systems.cooperative.smoother.wheeled_group import WheeledGroup
from groundstation.systems.cooperative.wheeled_vehicle import WheeledVehicle
from groundstation.tables.session import Odometry


@dataclass(frozen=True)
class Layout:
    """Places of all states in the joint state.

    Parameters
    ----------
    groups : tuple of Group
    members : tuple of tuple of int
        Vehicles of each group, by their number in the session.
    first : tuple of int
        Where each group begins.
    of_vehicle : ndarray of int, shape (v, 3)
        Group of each vehicle, its number there, and where its states begin.
    points : ndarray of int, shape (p,)
        Where the errors north and east of each ground point stand; -1: it is exact.
    pairs : dict of (vehicle, vehicle) to int
        Where the bias of ranges of a pair stands (see ``pair_of``).
    start, variance : ndarrays, shape (n,)
        Of all states.
    """

    groups: tuple[Group, ...]
    members: tuple[tuple[int, ...], ...]
    first: tuple[int, ...]
    of_vehicle: Int64Array
    points: Int64Array
    pairs: dict[tuple[int, int], int]
    start: FloatArray
    variance: FloatArray

    @property
    def size(self) -> int:
        """Number of all states."""
        return len(self.start)

    def of(self, vehicle: int) -> slice:
        """Return the states of a vehicle."""
        group, _, first = self.of_vehicle[vehicle].tolist()
        return slice(first, first + self.groups[group].size)

    def span(self, group: int) -> slice:
        """Return the states of a group."""
        one = self.groups[group]
        return slice(self.first[group], self.first[group] + one.size * one.count)


def layout_of(prepared: Prepared, settings: CooperativeSettings) -> Layout:
    """Put the vehicles of a session in groups, and give every state its place."""
    flying = [number for number, vehicle in enumerate(prepared.vehicles) if isinstance(vehicle, Aircraft)]
    rolling = [number for number in range(len(prepared.vehicles)) if number not in set(flying)]
    groups: list[Group] = []
    members: list[tuple[int, ...]] = []
    if flying:
        groups.append(AircraftGroup([one for one in prepared.vehicles if isinstance(one, Aircraft)]))
        members.append(tuple(flying))
    if rolling:
        vehicles = [one for one in prepared.vehicles if isinstance(one, WheeledVehicle)]
        tracks = [one for one in prepared.session.vehicles if isinstance(one, Odometry)]
        groups.append(WheeledGroup(vehicles, tracks, settings))
        members.append(tuple(rolling))
    of_vehicle, firsts, total = np.zeros((len(prepared.vehicles), 3), dtype=np.int64), [], 0
    starts, variances = [], []
    for number, (group, own) in enumerate(zip(groups, members, strict=True)):
        firsts.append(total)
        for index, vehicle in enumerate(own):
            of_vehicle[vehicle] = number, index, total + index * group.size
        x, variance = group.start()
        starts.append(x.ravel())
        variances.append(variance.ravel())
        total += x.size
    sigma = prepared.points.sigma_m
    points = np.full(len(sigma), -1, dtype=np.int64)
    for point in np.flatnonzero(sigma > 0.0).tolist():
        points[point], total = total, total + 2
        variances.append(np.full(2, sigma[point] ** 2))
    pairs: dict[tuple[int, int], int] = {}
    if settings.smoother.pair_bias_m > 0.0:
        for pair in _pairs(prepared):
            pairs[pair], total = total, total + 1
            variances.append(np.full(1, settings.smoother.pair_bias_m**2))
    x = np.zeros(total)
    vehicles_x = np.concatenate(starts)
    x[: len(vehicles_x)] = vehicles_x
    return Layout(tuple(groups), tuple(members), tuple(firsts), of_vehicle, points, pairs, x, np.concatenate(variances))


def pair_of(receiver: int, source: int, kind: int) -> tuple[int, int]:
    """Return the key of a pair.

    Both vehicles in either order, or a vehicle and a ground point (-1, -2, ...).
    """
    if kind == POINT:
        return receiver, -1 - source
    return min(receiver, source), max(receiver, source)


def _pairs(prepared: Prepared) -> Sequence[tuple[int, int]]:
    events = prepared.events
    mask = np.isin(events.kind, (PEER, POINT)) & np.isfinite(events.value_m)
    both = np.stack([events.receiver, events.source, events.kind])[:, mask]
    return sorted({pair_of(*one) for one in np.unique(both, axis=1).T.tolist()})
