"""The arrays behind the figures of the approaches."""

import numpy as np

from groundstation.systems.landing.arrays import LandingPath
from groundstation.systems.landing.geometry import Against
from groundstation.systems.landing.path import FlightPath


def path_columns(number: int, path: FlightPath, near: Against, rows: slice) -> LandingPath:
    """Every sample of a final and its roll-out."""
    return LandingPath(
        approach=np.full(rows.stop - rows.start, float(number)),
        time_s=path.time_s[rows],
        distance_m=near.distance_m,
        across_m=near.across_m,
        height_m=near.height_m,
        path_height_m=near.path_height_m,
        lateral_guidance_m=near.lateral_guidance_m,
        vertical_guidance_m=near.vertical_guidance_m,
        lateral_dot_m=near.lateral_dot_m,
        vertical_dot_m=near.vertical_dot_m,
        lateral_dots=path.lateral_dots[rows],
        vertical_dots=path.vertical_dots[rows],
        latitude_deg=path.latitude_deg[rows],
        longitude_deg=path.longitude_deg[rows],
        ground_speed_mps=path.ground_speed_mps[rows],
        sink_rate_mps=path.sink_rate_mps[rows],
        bank_deg=path.bank_deg[rows],
    )
