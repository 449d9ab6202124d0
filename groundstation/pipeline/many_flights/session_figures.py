"""Arrays of a session that no analysis owns: the clocks of its logs, and its ground points."""

import numpy as np

from groundstation.results.arrays.cooperative import SessionClocks, SessionPoints
from groundstation.results.figures import FigureData
from groundstation.tables.session_assemble import AssembledSession


def session_figures(assembled: AssembledSession) -> tuple[FigureData, ...]:
    """``session_clocks``, a row a log, and ``session_points`` where the session has ground points."""
    clocks, points = assembled.clocks, assembled.session.points
    offsets = [float("nan") if row.offset_s is None else row.offset_s for row in clocks]
    found: list[FigureData] = [
        SessionClocks(
            aircraft=np.array([row.aircraft for row in clocks], dtype=np.str_),
            log=np.array([row.log for row in clocks], dtype=np.str_),
            has_utc=np.array([row.has_utc for row in clocks], dtype=bool),
            ranges=np.array([row.ranges for row in clocks], dtype=np.int64),
            offset_s=np.array(offsets, dtype=np.float64),
            leaps=np.array([row.leaps for row in clocks], dtype=np.int64),
            is_corrected=np.array([row.is_corrected for row in clocks], dtype=bool),
        )
    ]
    if points:
        places = np.array([point.position_m for point in points])
        x_m, y_m, z_m = places.T
        found.append(
            SessionPoints(
                label=np.array([point.name for point in points], dtype=np.str_),
                x_m=x_m,
                y_m=y_m,
                z_m=z_m,
                position_sigma_m=np.array([point.position_sigma_m for point in points]),
            )
        )
    return tuple(found)
