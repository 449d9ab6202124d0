"""Tracks and ranges of a session as files of robot people: TUM and a g2o graph.

TUM (a file a vehicle): ``time x y z qx qy qz qw``, seconds UTC where the session has UTC. g2o (one file): a vertex
``VERTEX_SE3:QUAT`` for each vehicle and epoch, ``VERTEX_TRACKXYZ`` for ground points, with ``FIX`` where the answer
takes their place as exact (else it is the surveyed one), ``EDGE_SE3:QUAT`` for the dead reckoning from epoch to epoch,
and ``EDGE_RANGE id id range information`` for ranges. g2o has no edge of its own for a range alone, and readers of g2o
and gtsam leave lines with unknown tags out; the tag is that of range-aided solvers (PyFG), with the information in
place of the variance.

Axes are east, north and up, metres from the origin of the session, or from the first ground point or vehicle where the
session is on the globe. Attitudes are not estimated: the unit quaternion stands for them.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.ecef import ecef_from_n, geodetic_deg_m
from groundstation.base.errors import NotAssessableError, UsageError
from groundstation.base.nearest import nearest_rows
from groundstation.base.units import NS_PER_S
from groundstation.results.arrays.session import SessionPoints
from groundstation.results.flight import FlightResults
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.systems.cooperative.arrays import CooperativeLinks, CooperativeTracks

NO_TURN = "0 0 0 1"
LEAST_SIGMA_M = 1e-3  # of a step of dead reckoning
ANGLE_INFORMATION = 1e6  # attitudes stay as they are
RECKONING = "dead_reckoning"


class _Graph:
    """Tracks of one algorithm and of dead reckoning, points, in east, north, up."""

    def __init__(self, results: FlightResults, algorithm: str) -> None:
        answer, tracks = results.answer(CooperativeResult), results.rows_of(CooperativeTracks)
        if answer is None or tracks is None:
            raise NotAssessableError("export", "no tracks of vehicles", "the folder of a session")
        names = [row.algorithm for row in answer.algorithms]
        self.algorithm = algorithm or answer.default_algorithm
        if self.algorithm not in names:
            raise UsageError(f"track {algorithm}", "no algorithm of this session", f"one of {', '.join(names)}")
        self._is_local = answer.frame == "local"
        self.start_utc_ns, self._believed = results.start_utc_ns, answer.settings
        points = results.rows_of(SessionPoints)
        self.points: dict[str, FloatArray] = {}
        self.tracks, self.reckoned, self.variances = dict[str, FloatArray](), dict[str, FloatArray](), {}
        self.times: dict[str, FloatArray] = {}
        place_m = np.stack([tracks.x_m, tracks.y_m, tracks.z_m], axis=1)
        first = place_m[0] if points is None else np.array([points.x_m[0], points.y_m[0], points.z_m[0]])
        self.origin = None if self._is_local else geodetic_deg_m(first)
        self._first, self._axes = first, None if self._is_local else ecef_from_n(*self.origin[:2])  # type: ignore[index]
        self.free_points: set[str] = set()
        if points is not None:
            self._take_points(points, answer)
        for name in answer.vehicle_names:
            mine = (tracks.vehicle == name) & (tracks.algorithm == self.algorithm)
            reckoned = (tracks.vehicle == name) & (tracks.algorithm == RECKONING)
            if not mine.any():
                continue
            self.times[name], self.tracks[name] = tracks.time_s[mine], self._level(place_m[mine])
            if reckoned.sum() == mine.sum():
                self.reckoned[name] = self._level(place_m[reckoned])
                east, north = tracks.sigma_east_m[reckoned], tracks.sigma_north_m[reckoned]
                up = np.nan_to_num(tracks.sigma_up_m[reckoned], nan=0.0)
                self.variances[name] = np.stack([east, north, up], axis=1) ** 2

    def _take_points(self, points: SessionPoints, answer: CooperativeResult) -> None:
        """Take the ground points as the answer has them."""
        places = np.stack([points.x_m, points.y_m, points.z_m], axis=1)
        sigmas = dict(zip(points.label.tolist(), points.position_sigma_m.tolist(), strict=True))
        for row in answer.stations.rows if answer.stations is not None else ():
            sigmas[row.station] = row.used_sigma_m
            if row.survey_north_m is not None and row.survey_east_m is not None:
                at = points.label.tolist().index(row.station)
                axes = np.eye(3) if self._is_local else ecef_from_n(*geodetic_deg_m(places[at])[:2])
                places[at] += axes[:, :2] @ [row.survey_north_m, row.survey_east_m]
        self.free_points = {name for name, sigma_m in sigmas.items() if sigma_m > 0.0}
        self.points = dict(zip(points.label.tolist(), self._level(places), strict=True))

    def _level(self, place_m: FloatArray) -> FloatArray:
        """Return places as east, north, up."""
        if self._axes is None:
            return place_m[:, [1, 0, 2]] * [1.0, 1.0, -1.0]
        level = (place_m - self._first) @ self._axes
        return np.asarray(level[:, [1, 0, 2]] * [1.0, 1.0, -1.0])

    def head(self) -> str:
        """Comment lines on what the file holds."""
        axes = "east, north, up, m"
        if self.origin is not None:
            latitude, longitude, height = (float(part) for part in self.origin)
            axes += f" from latitude {latitude:.9f} longitude {longitude:.9f} height {height:.3f} m"
        return f"# {self.algorithm}; {axes}; attitudes are not estimated\n"

    def step_variance_m2(self, name: str) -> FloatArray:
        """Variance of the steps of dead reckoning, east, north, up.

        It is what the variance of its places grows by, so that the steps together are as uncertain as the whole; no
        less than the assumed velocity error makes in a step, nor, upwards, than the barometer changes in one.
        """
        step_s = np.diff(self.times[name])
        velocity, baro, baro_s = (float(self._believed[f"ins.{one}"]) for one in ("velocity_mps", "baro_m", "baro_s"))
        moved, changed = (velocity * step_s) ** 2, 2.0 * baro**2 * step_s / baro_s
        least = np.maximum(np.stack([moved, moved, changed], axis=1), LEAST_SIGMA_M**2)
        return np.maximum(np.diff(self.variances[name], axis=0), least)

    def place_at(self, name: str, time_s: FloatArray) -> FloatArray:
        """Place of a vehicle or point at some times."""
        if name not in self.tracks:
            return np.broadcast_to(self.points[name], (len(time_s), 3))
        return np.stack([np.interp(time_s, self.times[name], self.tracks[name][:, axis]) for axis in range(3)], axis=1)


def tum_files(results: FlightResults, algorithm: str) -> Mapping[str, str]:
    """Return the text of a TUM file for each vehicle."""
    graph = _Graph(results, algorithm)
    found = {}
    for name, track in graph.tracks.items():
        times = (_stamp(at_s, graph.start_utc_ns) for at_s in graph.times[name].tolist())
        lines = (f"{at} {_numbers(place)} {NO_TURN}\n" for at, place in zip(times, track, strict=True))
        found[name] = "".join([graph.head(), "# timestamp tx ty tz qx qy qz qw\n", *lines])
    return found


def _stamp(at_s: float, start_utc_ns: int | None) -> str:
    """Seconds with nine digits, UTC where it is known.

    Examples
    --------
    >>> _stamp(1.5, 1_777_874_400_000_000_001), _stamp(0.25, None)
    ('1777874401.500000001', '0.250000000')
    """
    whole_ns = round(at_s * NS_PER_S) + (start_utc_ns or 0)
    return f"{whole_ns // NS_PER_S}.{whole_ns % NS_PER_S:09d}"


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.4f}" for value in values.tolist())


def g2o_file(results: FlightResults, algorithm: str) -> Mapping[str, str]:
    """Return the text of the graph, under no name."""
    graph = _Graph(results, algorithm)
    numbers: dict[str, int] = {}
    lines = [graph.head()]
    for number, (name, place) in enumerate(graph.points.items()):
        lines += [f"# {number}: {name}\n", f"VERTEX_TRACKXYZ {number} {_numbers(place)}\n"]
        lines += [] if name in graph.free_points else [f"FIX {number}\n"]
        numbers[name] = number
    free = len(numbers)
    for name, track in graph.tracks.items():
        lines.append(f"# {free} to {free + len(track) - 1}: {name}\n")
        lines += [f"VERTEX_SE3:QUAT {free + row} {_numbers(place)} {NO_TURN}\n" for row, place in enumerate(track)]
        numbers[name] = free
        free += len(track)
    for name in graph.reckoned:
        lines += _steps(graph, name, numbers[name])
    links = results.rows_of(CooperativeLinks)
    lines += _ranges(graph, links, numbers) if links is not None and links.range_m is not None else []
    return {"": "".join(lines)}


def _steps(graph: _Graph, name: str, first: int) -> Iterator[str]:
    """Yield the dead reckoning of a vehicle from epoch to epoch."""
    moved, grown = np.diff(graph.reckoned[name], axis=0), graph.step_variance_m2(name)
    for row, (step, variance) in enumerate(zip(moved, grown, strict=True)):
        diagonal = [*(1.0 / variance).tolist(), *[ANGLE_INFORMATION] * 3]
        upper = [f"{diagonal[i]:.6g}" if i == j else "0" for i in range(6) for j in range(i, 6)]
        yield f"EDGE_SE3:QUAT {first + row} {first + row + 1} {_numbers(step)} {NO_TURN} {' '.join(upper)}\n"


def _ranges(graph: _Graph, links: CooperativeLinks, numbers: Mapping[str, int]) -> Iterator[str]:
    """Yield the ranges that were used, each between the nearest epochs of its ends.

    The tracks bring it there.
    """
    assert links.range_m is not None and links.range_sigma_m is not None
    wanted = np.isfinite(links.range_m) & (links.mark > 0)
    for receiver in graph.tracks:
        for source in numbers:
            mine = np.flatnonzero(wanted & (links.receiver == receiver) & (links.source == source))
            if not len(mine):
                continue
            at_s = links.time_s[mine]
            here = nearest_rows(graph.times[receiver], at_s)
            there = (
                nearest_rows(graph.times[source], at_s) if source in graph.tracks else np.zeros(len(mine), dtype=int)
            )
            then = np.linalg.norm(graph.place_at(receiver, at_s) - graph.place_at(source, at_s), axis=1)
            other = graph.tracks[source][there] if source in graph.tracks else graph.points[source]
            now = np.linalg.norm(graph.tracks[receiver][here] - other, axis=1)
            for a, b, read, sigma in zip(
                here.tolist(),
                there.tolist(),
                (links.range_m[mine] + now - then).tolist(),
                links.range_sigma_m[mine].tolist(),
                strict=True,
            ):
                yield f"EDGE_RANGE {numbers[receiver] + a} {numbers[source] + b} {read:.4f} {1.0 / sigma**2:.6g}\n"
