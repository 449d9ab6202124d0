"""Settings of recorded approaches: every limit of the method, with its source.

FSF: Flight Safety Foundation, ALAR Briefing Note 7.1, Stabilized Approach (2000). Airbus: Flight Operations Briefing
Notes, Flying Stabilized Approaches (2006). ICAO: Annex 10, volume I, 3.1.3 and 3.1.5.
"""

from dataclasses import asdict, field
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import check_ranges, number
from groundstation.base.units import M_PER_FOOT, MPS_PER_KNOT
from groundstation.systems.landing.criteria_settings import CriteriaSettings

Rounding = Literal["unknown", "nearest", "down"]
# Settings that bound a criterion and choose no data: a change of them needs no log.
LIMITS = frozenset({"deviation_max_dots", "sink_rate_max_mps", "bank_max_deg", "speed_above_max_mps", "criteria"})


@dataclass(frozen=True)
class LandingSettings:
    """Limits of the analysis of recorded approaches, each with what it bounds and its source."""

    # Established on the localizer: the deviation is smaller; chosen.
    established_lateral_dots: float = number(0.5, 0.05, 2.0)
    # Established on the glide path, where one is logged: the deviation is smaller; chosen.
    established_vertical_dots: float = number(1.0, 0.05, 2.0)
    established_min_s: float = number(20.0, 1.0, 600.0)  # established means so for so long; chosen

    # Finals: what is an approach.
    speed_min_mps: float = number(25.0, 5.0, 200.0)  # faster is an approach, slower a taxi; chosen
    # The search for a final goes so far back from its end; chosen.
    final_max_m: float = number(35_000.0, 2_000.0, 100_000.0)
    final_min_m: float = number(1_000.0, 100.0, 20_000.0)  # a final is straight for so long before its end; chosen
    final_height_min_m: float = number(30.0, 1.0, 1_000.0)  # a final descends by so much; chosen
    # Largest angle of the track to the course on a straight final; chosen.
    course_tolerance_deg: float = number(12.0, 1.0, 45.0)
    # A runway whose line passes farther off is another one; chosen.
    runway_reach_m: float = number(2_000.0, 50.0, 20_000.0)
    # Scale of the errors of positions where the table of runways is asked: half of them are within 1.7 times of it.

    # Scale of the errors of GNSS positions where the table of runways is asked: half are within 1.7 times of it;
    # chosen.
    gnss_position_scale_m: float = number(15.0, 0.1, 10_000.0)
    # Scale of the errors of INS positions where the table of runways is asked: half are within 1.7 times of it; chosen.
    ins_position_scale_m: float = number(300.0, 0.1, 10_000.0)
    # Lowest point of a go-around, at most so high; chosen.
    go_around_height_max_m: float = number(1_000.0 * M_PER_FOOT, 10.0, 1_000.0)
    # Climb from that lowest point that makes a go-around; chosen.
    go_around_climb_min_m: float = number(100.0, 10.0, 1_000.0)

    # Runway and its aids, where the site file does not say.

    # Width of the full localizer sector at the threshold, where the site file does not say; ICAO 3.1.3.7.1.
    localizer_width_m: float = number(700.0 * M_PER_FOOT, 10.0, 1_000.0)
    # Distance from the threshold to the localizer antenna, where the site file does not say; chosen.
    localizer_distance_m: float = number(3_300.0, 500.0, 10_000.0)
    # Angle of the glide path, where the site file does not say: the usual one.
    glide_angle_deg: float = number(3.0, 1.0, 10.0)
    # Height of the glide path over the threshold, where the site file does not say; ICAO 3.1.5.4.
    threshold_crossing_height_m: float = number(15.0, 0.0, 50.0)
    aiming_point_m: float = number(300.0, 0.0, 2_000.0)  # touchdown so far behind a threshold that is not known; chosen

    # Stabilised: the check heights (a gate in the name is one of them), then the limits of the criteria.

    # Higher check height of a stabilised approach; FSF: in instrument conditions.
    gate_high_m: float = number(1_000.0 * M_PER_FOOT, 20.0, 2_000.0)
    # Lower check height of a stabilised approach; FSF: in visual conditions.
    gate_low_m: float = number(500.0 * M_PER_FOOT, 20.0, 2_000.0)
    # Below it the flare begins and nothing is judged; chosen.
    gate_floor_m: float = number(100.0 * M_PER_FOOT, 0.0, 500.0)
    # Deviation from localizer and glide path at most; FSF: within one dot.
    deviation_max_dots: float = number(1.0, 0.1, 2.0)
    # Sink rate at most; FSF: no more than 1000 ft/min.
    sink_rate_max_mps: float = number(1_000.0 * M_PER_FOOT / 60.0, 0.5, 30.0)
    # Airspeed above the reference speed at most; FSF: reference + 20 kt.
    speed_above_max_mps: float = number(20.0 * MPS_PER_KNOT, 0.5, 100.0)
    bank_max_deg: float = number(7.0, 1.0, 60.0)  # bank at most; Airbus
    sustained_s: float = number(3.0, 0.0, 30.0)  # a value counts by what it keeps for so long: a gust is none; chosen
    # Reference speed VREF; empty: the speed at the end stands for it.
    reference_speed_mps: float | None = number(None, 5.0, 200.0)
    landing_flap_deg: float | None = number(None, 0.0, 90.0)  # least flap of a landing; empty: that of the end
    # Flap that differs from that of the landing by no more counts as set; chosen.
    flap_tolerance_deg: float = number(2.0, 0.0, 20.0)
    criteria: CriteriaSettings = field(default_factory=CriteriaSettings)

    # What a criterion is not decided by: sigmas of our own, not of any standard.

    # Sigma of recorded positions of an INS, by which criteria are left undecided; chosen.
    ins_position_sigma_m: float = number(200.0, 0.0, 20_000.0)
    # Sigma of a recorded wind, along and across, by which criteria are left undecided; chosen.
    wind_sigma_mps: float = number(2.5, 0.0, 20.0)
    # Sigma of a height over the threshold, by which criteria are left undecided; chosen.
    height_sigma_m: float = number(1.0, 0.0, 20.0)

    # The localizer as reference: tolerances as 95 %, then sigmas of places and positions.

    # Tolerance of the course line at the threshold, 95 %; ICAO 3.1.3.6.1: 7.5 and 3 m for II and III.
    course_line_m: float = number(10.5, 0.0, 100.0)
    # Bends of the course, 95 %; ICAO 3.1.3.4.2, category I near the threshold.
    bend_ddm: float = number(0.015, 0.0, 0.1)
    bend_length_m: float = number(1_000.0, 10.0, 10_000.0)  # length over which a bend of the course is one; chosen
    # Tolerance of the width of the localizer sector, share, 95 %; ICAO 3.1.3.7.3, category I and II.
    width_share: float = number(0.17, 0.0, 1.0)
    threshold_sigma_m: float = number(1.0, 0.0, 100.0)  # sigma of surveyed coordinates of the threshold; chosen
    centre_line_sigma_m: float = number(3.0, 0.1, 50.0)  # sigma of a roll-out beside the centre line; chosen
    # Sigma of the curvature of an INS position error over some minutes; chosen.
    position_curvature_mps2: float = number(1e-3, 0.0, 0.1)
    # Sigma of the noise of positions beyond the steps they are written in; chosen.
    position_noise_m: float = number(3.0, 0.01, 100.0)
    # How the recorder rounds positions; unknown: cut off or not, both are allowed for.
    positions_rounded: Rounding = "unknown"

    # The glide path as reference along the course.

    # Sigma of the height of the glide path over the threshold; ICAO 3.1.5.4: 15 m + 3 m.
    crossing_height_sigma_m: float = number(1.5, 0.0, 20.0)
    # Sigma of a height that no roll-out ties to the runway; chosen.
    height_zero_sigma_m: float = number(5.0, 0.0, 100.0)
    # Sigma of angle and scale of a distance by the glide path, share: angle (ICAO 3.1.5.1.2: 7.5 %), air that is no
    # standard.
    distance_scale_sigma: float = number(0.05, 0.0, 0.5)

    # The runway as reference of altitudes.

    # Height of the altitude's reference above the ground, on the wheels; chosen.
    reference_height_m: float = number(3.0, 0.0, 20.0)
    # Sigma of the height of the altitude's reference above the ground; chosen.
    reference_height_sigma_m: float = number(2.0, 0.0, 20.0)
    # Slope of a runway that is not known, 95 %; ICAO Annex 14, volume I, 3.1.13: 1 % of the length.
    runway_slope: float = number(0.01, 0.0, 0.1)
    # Sigma of the elevation of the threshold in the site file; chosen.
    elevation_sigma_m: float = number(0.3, 0.0, 20.0)

    def __post_init__(self) -> None:
        check_ranges(self)

    def told(self) -> dict[str, float | str | bool]:
        """Every setting that is set, by its key in the settings file."""
        plain = {name: value for name, value in asdict(self).items() if name != "criteria" and value is not None}
        return plain | self.criteria.told()
