"""Settings, gates and what is known of the aircraft and the airfield. Every limit of the method stands here."""

from dataclasses import dataclass, field, fields
from typing import Literal

from groundstation.base.errors import SettingsError

RateKind = Literal["slope", "raw"]
Runs = Literal["auto", "before_take_off", "all_ground"]


@dataclass(frozen=True)
class HeadingSettings:
    """Thresholds and gates of the heading estimator; the defaults are the paper's where it gives a figure.

    Source: Markelov, Kostishin, Shukalov, Heading correction of an INS before take-off by satellite navigation, 2015.
    """

    # Throughout
    geometry_max: float = 2.0  # geometric factor (paper)
    geometry_share_min: float = 0.9  # of the epochs that would otherwise be used
    integrity_share_min: float = 0.9
    heading_gap_max_s: float = 1.5  # INS heading is interpolated over no longer gap
    gnss_gap_max_s: float = 0.5  # a longer one closes the segment; at least 2.5 usual intervals

    # Stage A: standstill
    standstill_speed_max_mps: float = 0.2  # of the 1-s mean velocity (paper)
    standstill_mean_s: float = 1.0
    standstill_rate_max_dps: float = 0.2  # INS heading steady
    standstill_guard_s: float = 2.0  # cut from both ends: the aircraft starts to move below the limit
    standstill_min_s: float = 10.0  # paper: 10 to 30 s
    standstill_max_s: float = 30.0
    speed_of_mean_max_mps: float = 0.01  # paper
    spectrum_max_s: float = 300.0  # standstill used for the spectrum of the GNSS error

    # Stage B: taxi
    runs: Runs = "auto"  # ground runs used; auto: those before take-off, all of the flight's where those are too short
    taxi_speed_min_mps: float = 6.0  # paper
    taxi_speed_max_mps: float = 20.0  # faster is a take-off run or a landing roll
    lift_off_speed_mps: float = 40.0  # bounds the taxi phase where nothing tells ground from air
    turn_rate_max_dps: float = 1.0  # paper: |rate of INS heading|
    turn_rate_window_s: float = 2.0
    turn_rate_kind: RateKind = "slope"
    segment_break_s: float = 5.0  # unused stretch that ends a segment
    segment_turn_deg: float = 20.0  # change of heading over an unused stretch that ends a segment
    outlier_sigmas: float = 6.0  # against the running median of 5 s
    outlier_floor_deg: float = 1.0
    outlier_share_max: float = 0.02

    # Acceptance
    taxi_min_s: float = 20.0  # paper
    precision_max_deg: float = 0.05  # paper: e
    quality_max_deg: float = 0.3  # paper
    half_width_max_deg: float = 0.2  # of the honest interval: 20 arcmin is then more than three sigma
    skewness_max: float = 0.5
    excess_kurtosis_range: tuple[float, float] = (-1.2, 2.0)
    normal_distance_max: float = 0.08
    variance_ratio_range: tuple[float, float] = (0.5, 2.0)
    sway_line_s: float = 5.0
    drift_sigmas_max: float = 3.0

    # Lever arm and time offset
    arm_speed_min_mps: float = 3.0  # turns slower than this are not used to find the arm
    arm_rate_window_s: float = 0.2
    arm_interval_max_s: float = 0.5  # logs slower than this do not show the rate of a turn at the GNSS time
    arm_prior_m: float = 3.0  # an arm that is neither known nor observable: 3 +- 3 m ahead
    arm_prior_sigma_m: float = 3.0
    arm_observable_sigma_m: float = 1.0
    offset_prior_sigma_s: float = 0.1
    offset_observable_sigma_s: float = 0.05

    # Honest interval
    posterior_draws: int = 400
    posterior_seed: int = 2015
    growth_steps: int = 120

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, int | float) and value < 0:
                raise SettingsError(f"heading settings, {item.name}", str(value), "a value of 0 or more")


@dataclass(frozen=True)
class AircraftData:
    """What is known of the aircraft.

    Parameters
    ----------
    antenna_arm_m, antenna_arm_sigma_m : float or None
        GNSS antenna ahead of the middle of the main-gear axle (the point that does not slip sideways), and its sigma;
        None where unknown: it is then estimated, or its possible effect widens the interval.
    entry_step_deg : float
        Step in which the operator can enter the correction.
    mounting_deg, mounting_sigma_deg : float
        Heading of the INS case minus heading of the airframe, known, and the sigma of what remains of it
        (steady sideslip included). The sigma widens the interval.
    ins_class : str
        For the record.
    """

    antenna_arm_m: float | None = None
    antenna_arm_sigma_m: float = 0.05
    entry_step_deg: float = 0.1
    mounting_deg: float = 0.0
    mounting_sigma_deg: float = 0.0
    ins_class: str = ""


@dataclass(frozen=True)
class Stand:
    """Parking stand with a reference heading (theodolite) and its sigma."""

    name: str
    heading_deg: float
    sigma_deg: float = 0.05


@dataclass(frozen=True)
class Runway:
    """Runway with its true bearing (in the direction of take-off) and the position of its threshold."""

    name: str
    true_bearing_deg: float
    sigma_deg: float = 0.05
    latitude_deg: float | None = None
    longitude_deg: float | None = None


@dataclass(frozen=True)
class SiteData:
    """What is known of the airfield. ``stand`` names the stand the aircraft was parked on."""

    stands: tuple[Stand, ...] = ()
    runways: tuple[Runway, ...] = ()
    stand: str = ""

    def parked_on(self) -> Stand | None:
        """The named stand; the only one where none is named; else None."""
        if self.stand:
            return next((stand for stand in self.stands if stand.name == self.stand), None)
        return self.stands[0] if len(self.stands) == 1 else None


@dataclass(frozen=True)
class Interval:
    """Flight seconds that a file excludes from the estimate, or forces into it."""

    start_s: float
    end_s: float
    use: Literal["exclude", "force"] = "exclude"


@dataclass(frozen=True)
class HeadingRequest:
    """Choices for one flight: topics and intervals (empty: the first suitable pair, all of the taxi)."""

    ins_topic: str = ""
    gnss_topic: str = ""
    intervals: tuple[Interval, ...] = field(default=())
