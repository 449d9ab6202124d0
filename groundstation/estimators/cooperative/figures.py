"""Arrays behind the figures of the cooperative answer."""

from collections.abc import Sequence

import numpy as np

from groundstation.estimators.cooperative.consistency import Judgement
from groundstation.estimators.cooperative.events import PEER, POINT, Prepared
from groundstation.estimators.cooperative.geometry import Geometry
from groundstation.estimators.cooperative.tracks import AlgorithmRun
from groundstation.results.figures import FigureData


def source_name(prepared: Prepared, kind: str, source: int) -> str:
    """Name of what a measurement came from."""
    if kind == PEER:
        return prepared.vehicles[source].name
    return prepared.session.points[source].name if kind == POINT else kind


def tracks_figure(runs: Sequence[tuple[AlgorithmRun, Sequence[Judgement | None]]]) -> FigureData:
    """Positions, sigmas and errors of every vehicle under every algorithm."""
    parts: dict[str, list[np.ndarray]] = {}
    for run, judgements in runs:
        for track, judgement in zip(run.tracks, judgements, strict=True):
            n = len(track.time_s)
            nothing = np.full(n, np.nan)
            error = nothing if judgement is None else np.linalg.norm(judgement.error_m, axis=1)
            columns = {
                "time_s": track.time_s,
                "vehicle": np.full(n, track.name),
                "algorithm": np.full(n, run.algorithm),
                "x_m": track.position_m[:, 0],
                "y_m": track.position_m[:, 1],
                "z_m": track.position_m[:, 2],
                "sigma_north_m": np.sqrt(track.covariance[:, 0, 0]),
                "sigma_east_m": np.sqrt(track.covariance[:, 1, 1]),
                "sigma_up_m": track.sigma_up_m,
                "correlation_north_east": track.correlation,
                "two_sigma_r_m": track.two_sigma_r_m,
                "error_m": error,
                "nees": nothing if judgement is None else judgement.nees,
            }
            for name, values in columns.items():
                parts.setdefault(name, []).append(values)
    joined = {name: np.concatenate(values) for name, values in parts.items()}
    digits = {name: 3 for name in joined if name.endswith("_m")} | {"correlation_north_east": 4}
    return FigureData("cooperative_tracks", joined, digits)


def geometry_figure(geometry: Sequence[Geometry], bound: AlgorithmRun) -> FigureData:
    """Geometry of every vehicle with time, and the bound of its position (sigma_r)."""
    names = ("time_s", "sources", "hdop", "gdop", "determinant", "eigenvalue", "gram_determinant")
    columns = {name: np.concatenate([getattr(one, name) for one in geometry]) for name in names}
    columns["vehicle"] = np.concatenate([np.full(len(one.time_s), one.name) for one in geometry])
    sigma = []
    for one, track in zip(geometry, bound.tracks, strict=True):
        sigma.append(np.interp(one.time_s, track.time_s, 0.5 * track.two_sigma_r_m))
    columns["bound_m"] = np.concatenate(sigma)
    return FigureData("cooperative_geometry", columns, {"time_s": 3, "bound_m": 3})


def map_figure(runs: Sequence[AlgorithmRun]) -> FigureData:
    """Spectral radius of the joint error map of every decentralised run, window by window."""
    return FigureData(
        "cooperative_map",
        {
            "time_s": np.concatenate([run.map_time_s for run in runs]),
            "algorithm": np.concatenate([np.full(len(run.map_time_s), run.algorithm) for run in runs]),
            "spectral_radius": np.concatenate([run.map_radius for run in runs]),
        },
        {"time_s": 3},
    )


def links_figure(prepared: Prepared, run: AlgorithmRun) -> FigureData:
    """Innovations of every range of one algorithm; mark 1 used, -1 gated."""
    return FigureData(
        "cooperative_links",
        {
            "time_s": np.array([one.time_s for one in run.judged]),
            "receiver": np.array([prepared.vehicles[one.receiver].name for one in run.judged], dtype=np.str_),
            "source": np.array([source_name(prepared, one.kind, one.source) for one in run.judged], dtype=np.str_),
            "innovation": np.array([one.innovation for one in run.judged]),
            "sigma": np.array([one.sigma for one in run.judged]),
            "mark": np.array([one.mark for one in run.judged], dtype=np.int64),
        },
        {"time_s": 3},
    )


def traffic_figure(runs: Sequence[AlgorithmRun]) -> FigureData:
    """Messages and bytes of every vehicle under every algorithm."""
    rows = [(run.algorithm, name, *sent) for run in runs for name, sent in sorted(run.messages.items())]
    names = ("algorithm", "vehicle", "messages", "bytes")
    kinds = (np.str_, np.str_, np.int64, np.int64)
    return FigureData(
        "cooperative_traffic",
        {name: np.array([row[k] for row in rows], dtype=kinds[k]) for k, name in enumerate(names)},
        {},
    )
