"""Arrays of a session that no analysis owns: the clocks of its logs, and its ground points."""

import numpy as np

from groundstation.results.figures import FigureData
from groundstation.tables.session_assemble import AssembledSession


def session_figures(assembled: AssembledSession) -> tuple[FigureData, ...]:
    """``session_clocks``, a row a log, and ``session_points`` where the session has ground points."""
    clocks, points = assembled.clocks, assembled.session.points
    offsets = [float("nan") if row.offset_s is None else row.offset_s for row in clocks]
    found = [
        FigureData(
            "session_clocks",
            {
                "aircraft": np.array([row.aircraft for row in clocks], dtype=np.str_),
                "log": np.array([row.log for row in clocks], dtype=np.str_),
                "has_utc": np.array([row.has_utc for row in clocks], dtype=bool),
                "ranges": np.array([row.ranges for row in clocks], dtype=np.int64),
                "offset_s": np.array(offsets, dtype=np.float64),
                "leaps": np.array([row.leaps for row in clocks], dtype=np.int64),
                "is_corrected": np.array([row.is_corrected for row in clocks], dtype=bool),
            },
            {"offset_s": 6},
        )
    ]
    if points:
        places = np.array([point.position_m for point in points])
        columns = {f"{axis}_m": places[:, k].copy() for k, axis in enumerate("xyz")}
        columns["position_sigma_m"] = np.array([point.position_sigma_m for point in points])
        names = np.array([point.name for point in points], dtype=np.str_)
        found.append(FigureData("session_points", {"name": names, **columns}, {}))
    return tuple(found)
