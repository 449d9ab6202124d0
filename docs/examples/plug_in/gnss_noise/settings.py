"""Settings of the GNSS noise. Every limit of the method stands here."""

from dataclasses import dataclass

from groundstation.base.toml_settings import check_ranges, number


@dataclass(frozen=True)
class GnssNoiseSettings:
    """Which standstills are looked at."""

    standstill_min_s: float = number(10.0, 1.0, 3600.0)  # a shorter one shows too little
    guard_s: float = number(1.0, 0.0, 60.0)  # left out at either end, where the aircraft may still move

    def __post_init__(self) -> None:
        check_ranges(self)
