"""Settings of recorded approaches: every limit of the method, with its source.

FSF: Flight Safety Foundation, ALAR Briefing Note 7.1, Stabilized Approach (2000). Airbus: Flight Operations Briefing
Notes, Flying Stabilized Approaches (2006). ICAO: Annex 10, volume I, 3.1.3 and 3.1.5.
"""

from dataclasses import asdict, dataclass, field
from typing import Literal

from groundstation.base.toml_settings import check_ranges, number
from groundstation.base.units import M_PER_FOOT, MPS_PER_KNOT
from groundstation.systems.landing.criteria_settings import CriteriaSettings

Rounding = Literal["unknown", "nearest", "down"]
# Settings that bound a criterion and choose no data: a change of them needs no log.
LIMITS = frozenset({"deviation_max_dots", "sink_rate_max_mps", "bank_max_deg", "speed_above_max_mps", "criteria"})


@dataclass(frozen=True)
class LandingSettings:
    """Limits of the analysis of recorded approaches, each with what it bounds and its source."""

    # Established on the guidance: deviations below these for so long.
    established_lateral_dots: float = number(0.5, 0.05, 2.0)
    established_vertical_dots: float = number(1.0, 0.05, 2.0)  # counts where a glide path is logged
    established_min_s: float = number(20.0, 1.0, 600.0)

    # Finals: what is an approach.
    speed_min_mps: float = number(25.0, 5.0, 200.0)  # an approach, not a taxi
    final_max_m: float = number(35_000.0, 2_000.0, 100_000.0)  # the search goes so far back from the end
    final_min_m: float = number(1_000.0, 100.0, 20_000.0)  # straight before the end, at least
    final_height_min_m: float = number(30.0, 1.0, 1_000.0)  # that a final descends, at least
    course_tolerance_deg: float = number(12.0, 1.0, 45.0)  # of the track to the course on a straight final
    runway_reach_m: float = number(2_000.0, 50.0, 20_000.0)  # a line that passes farther off is another runway's
    # Scale of the errors of positions where the table of runways is asked: half of them are within 1.7 times of it.
    gnss_position_scale_m: float = number(15.0, 0.1, 10_000.0)
    ins_position_scale_m: float = number(300.0, 0.1, 10_000.0)
    go_around_height_max_m: float = number(1_000.0 * M_PER_FOOT, 10.0, 1_000.0)  # of its lowest point
    go_around_climb_min_m: float = number(100.0, 10.0, 1_000.0)  # from that point

    # Runway and its aids, where the site file does not say.
    localizer_width_m: float = number(700.0 * M_PER_FOOT, 10.0, 1_000.0)  # of the full sector there; ICAO 3.1.3.7.1
    localizer_distance_m: float = number(3_300.0, 500.0, 10_000.0)  # from the threshold to the antenna
    glide_angle_deg: float = number(3.0, 1.0, 10.0)
    threshold_crossing_height_m: float = number(15.0, 0.0, 50.0)  # of the glide path
    aiming_point_m: float = number(300.0, 0.0, 2_000.0)  # of a touchdown behind a threshold that is not known

    # Stabilised: the check heights (a gate in the name is one of them), then the limits of the criteria.
    gate_high_m: float = number(1_000.0 * M_PER_FOOT, 20.0, 2_000.0)  # FSF: in instrument conditions
    gate_low_m: float = number(500.0 * M_PER_FOOT, 20.0, 2_000.0)  # FSF: in visual conditions
    gate_floor_m: float = number(100.0 * M_PER_FOOT, 0.0, 500.0)  # below it the flare begins
    deviation_max_dots: float = number(1.0, 0.1, 2.0)  # FSF: within one dot of glide slope and localizer
    sink_rate_max_mps: float = number(1_000.0 * M_PER_FOOT / 60.0, 0.5, 30.0)  # FSF: no more than 1000 ft/min
    speed_above_max_mps: float = number(20.0 * MPS_PER_KNOT, 0.5, 100.0)  # FSF: reference + 20 kt
    bank_max_deg: float = number(7.0, 1.0, 60.0)  # Airbus
    sustained_s: float = number(3.0, 0.0, 30.0)  # a value counts by what it keeps for so long: a gust is none
    reference_speed_mps: float | None = number(None, 5.0, 200.0)  # VREF; none: the speed at the end stands for it
    landing_flap_deg: float | None = number(None, 0.0, 90.0)  # least flap of a landing; none: that of the end
    flap_tolerance_deg: float = number(2.0, 0.0, 20.0)
    criteria: CriteriaSettings = field(default_factory=CriteriaSettings)

    # What a criterion is not decided by: sigmas of our own, not of any standard.
    ins_position_sigma_m: float = number(200.0, 0.0, 20_000.0)  # of recorded positions of an INS
    wind_sigma_mps: float = number(2.5, 0.0, 20.0)  # of a recorded wind, along and across
    height_sigma_m: float = number(1.0, 0.0, 20.0)  # of a height over the threshold

    # The localizer as reference: tolerances as 95 %, then sigmas of places and positions.
    course_line_m: float = number(10.5, 0.0, 100.0)  # at the threshold; ICAO 3.1.3.6.1: 7.5 and 3 m for II and III
    bend_ddm: float = number(0.015, 0.0, 0.1)  # ICAO 3.1.3.4.2, category I near the threshold
    bend_length_m: float = number(1_000.0, 10.0, 10_000.0)  # over which a bend is one
    width_share: float = number(0.17, 0.0, 1.0)  # of the width; ICAO 3.1.3.7.3, category I and II
    threshold_sigma_m: float = number(1.0, 0.0, 100.0)  # surveyed coordinates
    centre_line_sigma_m: float = number(3.0, 0.1, 50.0)  # a roll-out beside the centre line
    position_curvature_mps2: float = number(1e-3, 0.0, 0.1)  # of an INS error over some minutes
    position_noise_m: float = number(3.0, 0.01, 100.0)  # beyond the steps it is written in
    positions_rounded: Rounding = (
        "unknown"  # how the recorder writes them; unknown: cut off or not, both are allowed for
    )

    # The glide path as reference along the course.
    crossing_height_sigma_m: float = number(1.5, 0.0, 20.0)  # of the path over the threshold; ICAO 3.1.5.4: 15 m + 3 m
    height_zero_sigma_m: float = number(5.0, 0.0, 100.0)  # of a height that no roll-out ties to the runway
    distance_scale_sigma: float = number(
        0.05, 0.0, 0.5
    )  # share: angle (ICAO 3.1.5.1.2: 7.5 %), air that is no standard

    # The runway as reference of altitudes.
    reference_height_m: float = number(3.0, 0.0, 20.0)  # of the altitude's reference above the ground, on the wheels
    reference_height_sigma_m: float = number(2.0, 0.0, 20.0)
    runway_slope: float = number(0.01, 0.0, 0.1)  # ICAO Annex 14, volume I, 3.1.13: 1 % of the length, as 95 %
    elevation_sigma_m: float = number(0.3, 0.0, 20.0)  # of the threshold in the site file

    def __post_init__(self) -> None:
        check_ranges(self)

    def told(self) -> dict[str, float | str | bool]:
        """Every setting that is set, by its key in the settings file."""
        plain = {name: value for name, value in asdict(self).items() if name != "criteria" and value is not None}
        return plain | self.criteria.told()
