"""Limits by which epochs on the ground are paired and gated.

The settings of a system have them among others.
"""

from typing import Literal, Protocol

from groundstation.base.dataclasses import dataclass

RateKind = Literal["slope", "raw"]


class TaxiLimits(Protocol):
    """Limits of taxi, and of the epochs that are used.

    Each is explained at ``HeadingSettings``.
    """

    @property
    def taxi_speed_min_mps(self) -> float: ...
    @property
    def taxi_speed_max_mps(self) -> float: ...
    @property
    def lift_off_speed_mps(self) -> float: ...
    @property
    def turn_rate_max_dps(self) -> float: ...
    @property
    def turn_rate_window_s(self) -> float: ...
    @property
    def turn_rate_kind(self) -> RateKind: ...
    @property
    def arm_rate_window_s(self) -> float: ...
    @property
    def geometry_max(self) -> float: ...
    @property
    def velocity_sigma_max_mps(self) -> float: ...
    @property
    def heading_gap_max_s(self) -> float: ...
    @property
    def gnss_gap_max_s(self) -> float: ...
    @property
    def segment_break_s(self) -> float: ...
    @property
    def segment_turn_deg(self) -> float: ...
    @property
    def outlier_sigmas(self) -> float: ...
    @property
    def outlier_floor_deg(self) -> float: ...


@dataclass(frozen=True)
class GroundLimits:
    """Limits of taxi for other headings than that of an INS.

    Speeds, rate and dilution are those of the paper.

    Source: Markelov, Kostishin, Shukalov, Heading correction of an INS before take-off by satellite navigation, 2015.
    """

    taxi_speed_min_mps: float = 6.0
    taxi_speed_max_mps: float = 20.0
    lift_off_speed_mps: float = 40.0
    turn_rate_max_dps: float = 1.0
    turn_rate_window_s: float = 2.0
    turn_rate_kind: RateKind = "slope"
    arm_rate_window_s: float = 0.2
    geometry_max: float = 2.0
    velocity_sigma_max_mps: float = 0.1
    heading_gap_max_s: float = 1.5
    gnss_gap_max_s: float = 0.5
    segment_break_s: float = 5.0
    segment_turn_deg: float = 20.0
    outlier_sigmas: float = 6.0
    outlier_floor_deg: float = 1.0
