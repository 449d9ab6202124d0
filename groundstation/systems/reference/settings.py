"""Settings of the comparison with a reference. Every limit of the method stands here."""

from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import check_ranges, number

UseArm = Literal["when_observed", "never"]


@dataclass(frozen=True)
class ReferenceSettings:
    """Settings of how a reference is aligned with a flight, and when it judges.

    ``topic`` of the reference's file judges; empty: the best one. ``clock_offset_s`` is added to the reference's times.
    The arm leads from the reference's point to the GNSS antenna of the log, in body axes; where none is stated it is
    estimated and taken out of the errors, if the turns show it.
    """

    topic: str = ""  # topic of the reference's file that judges; empty: the best one
    clock_offset_s: float = number(0.0, -86_400.0, 86_400.0)  # added to the times of the reference
    # Arm from the point of the reference to the GNSS antenna of the log, forward; empty: estimated.
    arm_forward_m: float | None = number(None, -200.0, 200.0)
    # Arm from the point of the reference to the GNSS antenna of the log, right; empty: estimated.
    arm_right_m: float | None = number(None, -200.0, 200.0)
    # when_observed: an estimated arm is taken out of the errors where the turns show it; never: it stays in them.
    use_arm: UseArm = "when_observed"
    gap_max_s: float = number(1.5, 0.01, 60.0)  # the reference is interpolated over no longer gap; chosen
    samples_min: int = number(10, 2, 100_000)  # fewest samples that log and reference have together; chosen
    samples_max: int = number(20_000, 100, 1_000_000)  # most samples of a subject; more are thinned evenly; chosen
    # Slower motion has no direction: no errors along and across the track; chosen.
    moving_mps: float = number(1.0, 0.0, 100.0)
    search_s: float = number(40.0, 0.0, 600.0)  # offsets tried either way for a clock that is grossly off; chosen
    # Half of the 95 % interval of an arm at most, for an arm that is observed; chosen.
    arm_half_width_max_m: float = number(0.5, 0.0, 100.0)
    # Half of the 95 % interval of a clock offset at most, for an offset that is told; chosen.
    clock_half_width_max_s: float = number(0.1, 0.0, 10.0)
    # Error seen over the reference's own sigma below which the reference is too coarse to judge; chosen.
    accuracy_ratio_min: float = number(2.0, 1.0, 1000.0)
    far_m: float = number(1_000.0, 1.0, 1e7)  # a larger median distance shows another vehicle or place; chosen
    intervals_s: tuple[float, ...] = (10.0, 60.0, 600.0)  # times over which relative errors are told; chosen
    # Distances travelled over which relative errors are told; chosen.
    ways_m: tuple[float, ...] = (100.0, 1_000.0, 10_000.0)

    def __post_init__(self) -> None:
        check_ranges(self)
