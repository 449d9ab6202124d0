"""Arrays of any flight: course, phases, states, counts of the ledger.

Times are flight seconds.
"""

from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.old_paths import name_that_left
from groundstation.results.arrays.typed import Arrays, Counts, Flags, Floats, Texts


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
    """Phases of the flight.

    ``proven`` is False where speed and height make a phase likely and nothing proves it. Logs of before all phases but
    ``unknown`` were proven lack it.
    """

    start_s: Floats
    end_s: Floats
    phase: Texts
    proven: Flags | None = None

    def proven_phase(self) -> Texts:
        """Return the phases with ``unknown`` for those that are not proven."""
        return self.phase if self.proven is None else np.where(self.proven, self.phase, "unknown")

    def likely_share(self) -> float:
        """Share of the time with a phase that is likely and not proven."""
        length_s = self.end_s - self.start_s
        total_s = float(np.sum(length_s))
        if self.proven is None or total_s <= 0.0:
            return 0.0
        return float(np.sum(length_s[~self.proven & (self.phase != "unknown")])) / total_s


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
