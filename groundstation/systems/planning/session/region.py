"""Region of a ground point: a rectangle without the polygons that are kept out.

It finds the nearest allowed places.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array, frozen

BOX = 4  # edges of the rectangle
EDGE_M = 1e-6  # so near to an edge a place is on it, and allowed


@dataclass(frozen=True)
class Region:
    """Allowed places in a plane, edges included.

    Parameters
    ----------
    low_m, high_m : ndarrays, shape (2,)
        Corners of the rectangle: north, east.
    keep_out : tuple of ndarray, shape (v, 2)
        Corners of each polygon in order; it may cross other ones.
    """

    low_m: FloatArray
    high_m: FloatArray
    keep_out: tuple[FloatArray, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "low_m", frozen(np.asarray(self.low_m, dtype=np.float64)))
        object.__setattr__(self, "high_m", frozen(np.asarray(self.high_m, dtype=np.float64)))
        object.__setattr__(self, "keep_out", tuple(frozen(np.asarray(one, dtype=np.float64)) for one in self.keep_out))

    def mirrored(self) -> "Region":
        """Return the part of the region that is allowed on both sides of the axis east = 0."""
        flipped = tuple(one * np.array([1.0, -1.0]) for one in self.keep_out)
        half = min(-self.low_m[1], self.high_m[1])
        low, high = np.array([self.low_m[0], -half]), np.array([self.high_m[0], half])
        return Region(low, high, (*self.keep_out, *flipped))

    @cached_property
    def _edges(self) -> FloatArray:
        """Ends of all edges, shape (e, 2, 2): four of the rectangle, then those of the polygons."""
        (north, east), (far_north, far_east) = self.low_m, self.high_m
        box = np.array([[north, east], [far_north, east], [far_north, far_east], [north, far_east]])
        rings = (box, *self.keep_out)
        return np.concatenate([np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings])

    @cached_property
    def _first(self) -> Int64Array:
        """First edge of each polygon, counted from the first of them all."""
        return np.cumsum([0, *(len(ring) for ring in self.keep_out[:-1])])

    @cached_property
    def corners(self) -> FloatArray:
        """Corners of the allowed places and edge crossings, shape (c, 2); none if none is allowed."""
        edges = self._edges
        begin, way = edges[:, 0], edges[:, 1] - edges[:, 0]
        one, other = np.triu_indices(len(edges), 1)
        across = _cross(way[one], way[other])
        between = begin[other] - begin[one]
        with np.errstate(divide="ignore", invalid="ignore"):
            along, along_other = _cross(between, way[other]) / across, _cross(between, way[one]) / across
            meets = (across != 0.0) & (along >= 0.0) & (along <= 1.0) & (along_other >= 0.0) & (along_other <= 1.0)
        crossings = begin[one[meets]] + along[meets, None] * way[one[meets]]
        candidates = np.concatenate([begin, crossings])
        return frozen(candidates[self.allows(candidates)])

    @property
    def is_empty(self) -> bool:
        """Tell whether no place is allowed."""
        return bool(np.any(self.low_m > self.high_m)) or not len(self.corners)

    def allows(self, place_m: FloatArray) -> BoolArray:
        """Tell whether each place (n, 2) is allowed."""
        inside_box = ((place_m >= self.low_m - EDGE_M) & (place_m <= self.high_m + EDGE_M)).all(axis=1)
        if not self.keep_out:
            return np.asarray(inside_box)
        edges = self._edges[BOX:]
        crossings = np.add.reduceat(_is_crossed(edges, place_m), self._first, axis=1)
        distance = np.minimum.reduceat(_nearest_on(edges, place_m)[1], self._first, axis=1)
        return np.asarray(inside_box & ~((crossings % 2 == 1) & (distance > EDGE_M)).any(axis=1))

    def nearest(self, place_m: FloatArray) -> FloatArray:
        """Nearest allowed place to one, shape (2,).

        That is the place itself, the nearest of some edge, or an end of the allowed part of an edge: a corner.
        """
        clipped = np.clip(place_m, self.low_m, self.high_m)
        if not self.keep_out or self.allows(clipped[None])[0]:
            return clipped
        on_edges = _nearest_on(self._edges, place_m[None])[0][0]
        candidates = np.concatenate([on_edges[self.allows(on_edges)], self.corners])
        distance = np.linalg.norm(candidates - place_m, axis=1)
        return np.asarray(candidates[int(np.argmin(distance))])

    def distance_m(self, place_m: FloatArray) -> float:
        """Distance of a place to the nearest edge of what is kept out; infinite without."""
        return float(_nearest_on(self._edges[BOX:], place_m[None])[1].min(initial=np.inf))


def _cross(one: FloatArray, other: FloatArray) -> FloatArray:
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def _nearest_on(edges: FloatArray, place_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nearest place of every edge to every place, shape (n, e, 2), and how far it is, (n, e)."""
    begin, way = edges[:, 0], edges[:, 1] - edges[:, 0]
    length = np.maximum((way**2).sum(axis=1), 1e-300)
    share = np.clip(((place_m[:, None] - begin) * way).sum(axis=2) / length, 0.0, 1.0)
    nearest = begin + share[:, :, None] * way
    away = nearest - place_m[:, None]
    return nearest, np.sqrt((away**2).sum(axis=2))


def _is_crossed(edges: FloatArray, place_m: FloatArray) -> Int64Array:
    """Tell whether a ray from each place to the east crosses each edge, shape (n, e)."""
    begin, end = edges[:, 0], edges[:, 1]
    north, east = place_m[:, :1], place_m[:, 1:]
    straddles = (begin[:, 0] > north) != (end[:, 0] > north)
    rise = np.where(end[:, 0] == begin[:, 0], 1.0, end[:, 0] - begin[:, 0])
    crossing = begin[:, 1] + (north - begin[:, 0]) / rise * (end[:, 1] - begin[:, 1])
    return np.asarray(straddles & (east < crossing), dtype=np.int64)


def polygon(corners: Sequence[Sequence[float]]) -> FloatArray:
    """Corners of a polygon, shape (v, 2)."""
    return np.array(corners, dtype=np.float64).reshape(-1, 2)
