"""Arrays of any flight: course, phases, states, counts of the ledger.

Times are flight seconds.
"""

from typing import TYPE_CHECKING

from groundstation.base.old_paths import name_that_left
from groundstation.results.arrays.typed import Arrays, Counts, Floats, Texts


class Overview(
    Arrays,
    figure="overview",
    digits={"latitude_deg": 7, "longitude_deg": 7, "altitude_m": 1, "pressure_altitude_m": 1, "*": 2},
):
    """Thinned flight for the map and profiles; fields that only some logs have are optional."""

    time_s: Floats
    latitude_deg: Floats
    longitude_deg: Floats
    altitude_m: Floats
    ground_speed_mps: Floats
    heading_deg: Floats
    track_deg: Floats
    climb_mps: Floats
    roll_deg: Floats | None = None
    pitch_deg: Floats | None = None
    magnetic_heading_deg: Floats | None = None
    true_airspeed_mps: Floats | None = None
    indicated_airspeed_mps: Floats | None = None
    pressure_altitude_m: Floats | None = None
    height_above_airfield_m: Floats | None = None


class PhaseSpans(Arrays, figure="phases", digits={"start_s": 1, "end_s": 1}):
    """Phases of the flight."""

    start_s: Floats
    end_s: Floats
    phase: Texts


class GnssLanes(Arrays, figure="gnss_lanes", digits={"start_s": 2, "end_s": 2}):
    """States of GNSS, each until the next one."""

    start_s: Floats
    end_s: Floats
    state: Texts


class StateLanes(Arrays, figure="state_lanes", digits={"start_s": 2, "end_s": 2}):
    """Flight mode, arming and ground contact as logged, a lane each."""

    lane: Texts
    start_s: Floats
    end_s: Floats
    state: Texts


class LedgerRows(
    Arrays,
    figure="ledger",
    digits={
        "coverage": 4,
        "nominal_rate_hz": 3,
        "actual_rate_hz": 3,
        "longest_gap_s": 2,
        "first_s": 2,
        "last_s": 2,
    },
):
    """Counts of each topic."""

    topic: Texts
    rows: Counts
    duplicates: Counts
    backward_steps: Counts
    stray_rows: Counts
    nominal_rate_hz: Floats
    actual_rate_hz: Floats
    coverage: Floats
    gaps: Counts
    longest_gap_s: Floats
    dropped_rows: Counts
    lost_by_counter: Counts
    out_of_range: Counts
    stuck: Counts
    first_s: Floats
    last_s: Floats


class GapRows(Arrays, figure="gaps", digits={"start_s": 2, "length_s": 2}):
    """Gaps of each topic."""

    topic: Texts
    start_s: Floats
    length_s: Floats


if not TYPE_CHECKING:  # which would no longer miss a name

    def __getattr__(name: str) -> object:
        return name_that_left(__name__, name)
