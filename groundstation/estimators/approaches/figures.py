"""The arrays behind the figures of the approaches."""

from collections.abc import Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.estimators.approaches.geometry import Against
from groundstation.estimators.approaches.path import FlightPath
from groundstation.results.figures import FigureData

DIGITS = {
    "approach": 0,
    "time_s": 3,
    "distance_m": 1,
    "across_m": 1,
    "height_m": 1,
    "path_height_m": 1,
    "lateral_guidance_m": 1,
    "vertical_guidance_m": 1,
    "lateral_dot_m": 2,
    "vertical_dot_m": 2,
    "lateral_dots": 3,
    "vertical_dots": 3,
    "latitude_deg": 7,
    "longitude_deg": 7,
    "ground_speed_mps": 2,
    "sink_rate_mps": 2,
    "bank_deg": 2,
}


def path_columns(number: int, path: FlightPath, near: Against, rows: slice) -> dict[str, FloatArray]:
    """Every sample of a final and its roll-out."""
    return {
        "approach": np.full(rows.stop - rows.start, float(number)),
        "time_s": path.time_s[rows],
        "distance_m": near.distance_m,
        "across_m": near.across_m,
        "height_m": near.height_m,
        "path_height_m": near.path_height_m,
        "lateral_guidance_m": near.lateral_guidance_m,
        "vertical_guidance_m": near.vertical_guidance_m,
        "lateral_dot_m": near.lateral_dot_m,
        "vertical_dot_m": near.vertical_dot_m,
        "lateral_dots": path.lateral_dots[rows],
        "vertical_dots": path.vertical_dots[rows],
        "latitude_deg": path.latitude_deg[rows],
        "longitude_deg": path.longitude_deg[rows],
        "ground_speed_mps": path.ground_speed_mps[rows],
        "sink_rate_mps": path.sink_rate_mps[rows],
        "bank_deg": path.bank_deg[rows],
    }


def path_figure(parts: Sequence[dict[str, FloatArray]]) -> FigureData:
    """All approaches in one table, one after the other."""
    columns = {name: np.concatenate([part[name] for part in parts]) for name in DIGITS}
    return FigureData("landing_path", columns, DIGITS)


def protection_figure(parts: Sequence[dict[str, FloatArray]]) -> tuple[FigureData, ...]:
    """Protection levels of all approaches that have any."""
    having = [(number, part) for number, part in enumerate(parts, start=1) if part]
    if not having:
        return ()
    names = list(having[0][1])
    columns = {name: np.concatenate([part[name] for _number, part in having]) for name in names}
    columns["approach"] = np.concatenate([np.full(len(part["time_s"]), float(number)) for number, part in having])
    return (FigureData("landing_protection", columns, dict.fromkeys(names, 1) | {"time_s": 3, "approach": 0}),)
