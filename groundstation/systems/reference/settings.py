"""Settings of the comparison with a reference. Every limit of the method stands here."""

from dataclasses import dataclass
from typing import Literal

from groundstation.base.toml_settings import check_ranges, number

UseArm = Literal["when_observed", "never"]


@dataclass(frozen=True)
class ReferenceSettings:
    """Settings of how a reference is aligned with a flight, and when it judges.

    ``topic`` of the reference's file judges; empty: the best one. ``clock_offset_s`` is added to the reference's times.
    The arm leads from the reference's point to the GNSS antenna of the log, in body axes; where none is stated it is
    estimated and taken out of the errors, if the turns show it.
    """

    topic: str = ""
    clock_offset_s: float = number(0.0, -86_400.0, 86_400.0)
    arm_forward_m: float | None = number(None, -200.0, 200.0)
    arm_right_m: float | None = number(None, -200.0, 200.0)
    use_arm: UseArm = "when_observed"
    gap_max_s: float = number(1.5, 0.01, 60.0)  # nothing is interpolated over a longer one
    samples_min: int = number(10, 2, 100_000)
    samples_max: int = number(20_000, 100, 1_000_000)  # of a subject; more are thinned evenly
    moving_mps: float = number(1.0, 0.0, 100.0)  # slower motion has no direction: no along and cross
    search_s: float = number(40.0, 0.0, 600.0)  # either way, for a clock that is grossly off
    arm_half_width_max_m: float = number(0.5, 0.0, 100.0)  # of the 95 % interval of an arm that is observed
    clock_half_width_max_s: float = number(0.1, 0.0, 10.0)
    accuracy_ratio_min: float = number(2.0, 1.0, 1000.0)  # error seen over the reference's own sigma
    far_m: float = number(1_000.0, 1.0, 1e7)  # a median distance beyond it is another vehicle or place
    intervals_s: tuple[float, ...] = (10.0, 60.0, 600.0)  # of relative errors
    ways_m: tuple[float, ...] = (100.0, 1_000.0, 10_000.0)

    def __post_init__(self) -> None:
        check_ranges(self)
