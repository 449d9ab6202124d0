"""Error of recorded altitudes on the runway, whose elevation is a reference without GNSS.

On its wheels the aircraft stands on the runway, so altitude less elevation less the height of the altitude's reference
above the ground is the error, at the touchdown and for some seconds after it. Before, the glide slope does not show it:
a deviation says height above the path where the distance is known, and the error of a distance enters as its tangent,
so that error of altitude and error along the course are seen as one sum.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.runways.table import ELEVATION_SIGMA_M
from groundstation.results.landing_categories import LINEAR_95
from groundstation.systems.landing.answer import ErrorPart, HeightError, RunwayUsed
from groundstation.systems.landing.geometry import ROLL_OUT_MIN_MPS, ROLL_OUT_S, along_and_across
from groundstation.systems.landing.path import POSITION, FlightPath
from groundstation.systems.landing.settings import LandingSettings

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

ALTITUDES = ("altitude_msl_m", "altitude_ellipsoid_m")
FEWEST = 3


def height_error(
    flight: "Flight", topic: str, path: FlightPath, runway: RunwayUsed, touchdown_s: float, settings: LandingSettings
) -> HeightError | None:
    """Error of the altitude of one topic on the roll-out; None where it has none."""
    table = flight[topic].unique_times()
    name = next((one for one in ALTITUDES if table.has(one)), None)
    if name is None:
        return None
    time_s = flight.seconds(table.time_ns)
    speed_mps = np.interp(time_s, path.time_s, path.ground_speed_mps)
    rows = table.valid(name, *POSITION) & (speed_mps >= ROLL_OUT_MIN_MPS)
    rows &= (time_s >= touchdown_s) & (time_s <= touchdown_s + ROLL_OUT_S)
    used = table.take(rows)
    if not runway.is_surveyed or runway.elevation_m is None:
        return HeightError(topic, "not measured", "no elevation of the runway", len(used))
    if name != ALTITUDES[0]:
        reason = "altitude above the ellipsoid, where the elevation counts from mean sea level"
        return HeightError(topic, "not measured", reason, len(used))
    if len(used) < FEWEST:
        return HeightError(topic, "not measured", "too few altitudes on the roll-out", len(used))
    before_m, _ = along_and_across(used.values("latitude_deg"), used.values("longitude_deg"), runway)
    altitude_m = used.values(name)
    elevation_sigma_m = settings.elevation_sigma_m if runway.placed_by == "site file" else ELEVATION_SIGMA_M
    error_m = float(np.mean(altitude_m)) - runway.elevation_m - settings.reference_height_m
    parts = (
        ErrorPart("slope of the runway", 0.5 * settings.runway_slope * abs(float(np.mean(before_m)))),  # 95 %
        ErrorPart("height above the wheels", settings.reference_height_sigma_m),
        ErrorPart("elevation of the threshold", elevation_sigma_m),
        ErrorPart("scatter of the altitudes", float(np.std(altitude_m))),  # it may last as long as the roll-out
    )
    sigma_m = math.hypot(*(part.sigma_m for part in parts))
    interval_m = (error_m - LINEAR_95 * sigma_m, error_m + LINEAR_95 * sigma_m)
    return HeightError(topic, "measured", "", len(used), error_m, sigma_m, interval_m, parts)
