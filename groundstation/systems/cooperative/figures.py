"""Arrays behind the figures of the cooperative answer."""

from collections.abc import Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.results.arrays.typed import joined
from groundstation.systems.cooperative.arrays import (
    CooperativeGeometry,
    CooperativeLinks,
    CooperativeMap,
    CooperativeStations,
    CooperativeTracks,
    CooperativeTraffic,
)
from groundstation.systems.cooperative.consistency import TrackJudgement
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.geometry import Geometry
from groundstation.systems.cooperative.loop_types import KINDS, PEER, POINT
from groundstation.systems.cooperative.stations_answer import StationsAnswer
from groundstation.systems.cooperative.tracks import AlgorithmRun, VehicleTrack


def source_name(prepared: Prepared, kind: int, source: int) -> str:
    """Name of what a measurement came from."""
    if kind == PEER:
        return prepared.vehicles[source].name
    return prepared.session.points[source].name if kind == POINT else KINDS[kind]


def tracks_figure(runs: Sequence[tuple[AlgorithmRun, Sequence[TrackJudgement | None]]]) -> CooperativeTracks:
    """Positions, sigmas and errors of every vehicle under every algorithm."""
    parts = []
    for run, judgements in runs:
        for track, judgement in zip(run.tracks, judgements, strict=True):
            n = len(track.time_s)
            nothing = np.full(n, np.nan)
            error = nothing if judgement is None else np.linalg.norm(judgement.error_m, axis=1)
            parts.append(
                CooperativeTracks(
                    time_s=track.time_s,
                    vehicle=np.full(n, track.name),
                    algorithm=np.full(n, run.algorithm),
                    x_m=track.position_m[:, 0],
                    y_m=track.position_m[:, 1],
                    z_m=track.position_m[:, 2],
                    sigma_north_m=np.sqrt(track.covariance[:, 0, 0]),
                    sigma_east_m=np.sqrt(track.covariance[:, 1, 1]),
                    sigma_up_m=track.sigma_up_m,
                    correlation_north_east=track.correlation,
                    two_sigma_r_m=track.two_sigma_r_m,
                    error_m=error,
                    nees=nothing if judgement is None else judgement.nees,
                )
            )
    return joined(parts)


def geometry_figure(geometry: Sequence[Geometry], bound: AlgorithmRun) -> CooperativeGeometry:
    """Geometry of every vehicle with time, and the bound of its position (sigma_r)."""
    return joined(
        [
            CooperativeGeometry(
                time_s=one.time_s,
                sources=one.sources,
                hdop=one.hdop,
                gdop=one.gdop,
                determinant=one.determinant,
                eigenvalue=one.eigenvalue,
                gram_determinant=one.gram_determinant,
                vehicle=np.full(len(one.time_s), one.name),
                bound_m=np.interp(one.time_s, track.time_s, 0.5 * track.two_sigma_r_m),
            )
            for one, track in zip(geometry, bound.tracks, strict=True)
        ]
    )


def map_figure(runs: Sequence[AlgorithmRun]) -> CooperativeMap:
    """Spectral radius of the joint error map of every decentralised run, window by window."""
    return CooperativeMap(
        time_s=np.concatenate([run.map_time_s for run in runs]),
        algorithm=np.concatenate([np.full(len(run.map_time_s), run.algorithm) for run in runs]),
        spectral_radius=np.concatenate([run.map_radius for run in runs]),
    )


def links_figure(prepared: Prepared, run: AlgorithmRun, answer: AlgorithmRun) -> CooperativeLinks:
    """Innovations of every range of one algorithm; mark 1 used, -1 gated.

    Clocks and biases that are taken off the ranges are those of the answer.
    """
    judged, events = run.judged, prepared.events
    kind, source, receiver = (part[judged.event].tolist() for part in (events.kind, events.source, events.receiver))
    names = [vehicle.name for vehicle in prepared.vehicles]
    range_m, sigma_m = _ranges(prepared, run, answer.tracks)
    return CooperativeLinks(
        time_s=events.time_s[judged.event],
        receiver=np.array([names[one] for one in receiver], dtype=np.str_),
        source=np.array([source_name(prepared, *one) for one in zip(kind, source, strict=True)], dtype=np.str_),
        innovation=judged.innovation,
        sigma=judged.sigma,
        mark=judged.mark,
        range_m=range_m,
        range_sigma_m=sigma_m,
    )


def _ranges(prepared: Prepared, run: AlgorithmRun, tracks: Sequence[VehicleTrack]) -> tuple[FloatArray, FloatArray]:
    """Return ranges less clocks and biases as estimated, and their sigmas.

    NaN for what is no range.
    """
    event, events = run.judged.event, prepared.events
    is_first = np.ones(len(event), dtype=bool)  # the second row of an event is its bearing
    is_first[1:] = event[1:] != event[:-1]
    kind, receiver, source, at_s = (
        part[event] for part in (events.kind, events.receiver, events.source, events.time_s)
    )
    is_range = is_first & np.isin(kind, (PEER, POINT)) & np.isfinite(events.value_m[event])
    range_m = np.where(is_range, events.value_m[event], np.nan)
    for who, (vehicle, track) in enumerate(zip(prepared.vehicles, tracks, strict=True)):
        if not len(track.time_s):
            continue
        for state, ends in (
            (vehicle.clock, ((receiver == who, -1.0), ((kind == PEER) & (source == who), 1.0))),
            (vehicle.bias, ((receiver == who, -1.0),)),
        ):
            is_free = state == vehicle.clock and prepared.session.ranges.is_two_way
            for rows, sign in ends if state >= 0 and not is_free else ():
                range_m[rows] += sign * np.interp(at_s[rows], track.time_s, track.state[:, state])
    return range_m, np.where(is_range, np.sqrt(events.variance_m2[event]), np.nan)


def stations_figure(stations: StationsAnswer) -> CooperativeStations:
    """Ground stations as the session judges them."""
    columns = {name: [getattr(row, name) for row in stations.rows] for name in CooperativeStations.__annotations__}
    return CooperativeStations(
        **{name: np.array([np.nan if value is None else value for value in values]) for name, values in columns.items()}
    )


def traffic_figure(runs: Sequence[AlgorithmRun]) -> CooperativeTraffic:
    """Messages and bytes of every vehicle under every algorithm."""
    rows = [(run.algorithm, name, *sent) for run in runs for name, sent in sorted(run.messages.items())]
    return CooperativeTraffic(
        algorithm=np.array([row[0] for row in rows], dtype=np.str_),
        vehicle=np.array([row[1] for row in rows], dtype=np.str_),
        messages=np.array([row[2] for row in rows], dtype=np.int64),
        bytes=np.array([row[3] for row in rows], dtype=np.int64),
    )
