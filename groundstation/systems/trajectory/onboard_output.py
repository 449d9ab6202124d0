"""Output of an on-board filter, from the tables of its log."""

from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import has_position
from groundstation.base.records import HEADING_IS_TRACK
from groundstation.systems.trajectory.onboard_filters import LoggedFilter
from groundstation.systems.trajectory.sampling import thinned
from groundstation.systems.trajectory.solution import FloatArray
from groundstation.tables.table import Flight

STEP_S = 0.1  # faster output says no more
MOST_SAMPLES = 100_000
FEWEST = 30  # samples beside the track
OPPOSITE = -0.8  # correlation with ours below which the sign of a velocity is the other one


@dataclass(frozen=True)
class FilterOutput:
    """Output of the filter, NaN where not logged.

    Roll, pitch, heading and velocity have shape (n, 3). ``plane_m`` is north and east of an origin that is not logged,
    where there is no latitude.
    """

    time_s: FloatArray
    attitude_deg: FloatArray
    velocity_mps: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    height_m: FloatArray
    plane_m: FloatArray


def output_of(flight: Flight, of: LoggedFilter) -> FilterOutput | None:
    """Return the output of a filter at 10 Hz; None where it has too few rows."""
    table = of.table.trusted().unique_times()
    if len(table) < FEWEST:
        return None
    time_s = flight.seconds(table.time_ns)
    step_s = max(STEP_S, float(time_s[-1] - time_s[0]) / MOST_SAMPLES)
    table = table.take(thinned(time_s, step_s))
    is_track = f"{HEADING_IS_TRACK}.{of.topic}.true_heading_deg" in flight.metadata
    heading = np.full(len(table), np.nan) if is_track else table.values("true_heading_deg")
    height = table.values("altitude_ellipsoid_m")
    for values in (table.values("altitude_msl_m"), -table.values("position_down_m")):
        height = height if np.isfinite(height).any() else values
    latitude, longitude = table.values("latitude_deg"), table.values("longitude_deg")
    is_place = has_position(latitude, longitude)
    return FilterOutput(
        flight.seconds(table.time_ns),
        np.column_stack([table.values("roll_deg"), table.values("pitch_deg"), heading]),
        np.column_stack([table.values(f"velocity_{axis}_mps") for axis in ("north", "east", "down")]),
        np.where(is_place, latitude, np.nan),
        np.where(is_place, longitude, np.nan),
        height,
        np.column_stack([table.values(f"position_{axis}_m") for axis in ("north", "east")]),
    )


def with_down(output: FilterOutput, down_mps: FloatArray) -> tuple[FilterOutput, bool]:
    """Return the output with its velocity downward, and whether it logs it upward."""
    theirs = output.velocity_mps[:, 2]
    known = np.isfinite(theirs) & np.isfinite(down_mps)
    if known.sum() < FEWEST or not np.std(down_mps[known]) * np.std(theirs[known]) > 0.0:
        return output, False
    if np.corrcoef(theirs[known], down_mps[known])[0, 1] > OPPOSITE:
        return output, False
    return replace(output, velocity_mps=output.velocity_mps * np.array([1.0, 1.0, -1.0])), True
