"""Settings of landing by locators."""

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import check_ranges, number


@dataclass(frozen=True)
class LandingBeaconsSettings:
    """Assumed errors of bearings and radio altitude, and what counts as an approach.

    Parameters
    ----------
    bearing_sigma_deg : float
        Sigma of a relative bearing; 2 to 3 degrees are usual for an automatic direction finder.
    height_sigma_m : float
        Sigma of the radio altitude.
    highest_m : float
        Radio altitude above which nothing is an approach.
    shortest_s : float
        Shortest flight below ``highest_m``, with bearings of all beacons, that is an approach.
    largest_gap_s : float
        Longest step between two samples that is interpolated over.
    silence_ratio : float
        A beacon nearer than so many heights is overhead: no bearing of it is used.
    terrain_m : float
        Rise and fall of the ground that is worth a warning.
    """

    bearing_sigma_deg: float = number(2.0, 0.01, 30.0)
    height_sigma_m: float = number(0.5, 0.0, 100.0)
    highest_m: float = number(600.0, 30.0, 3000.0)
    shortest_s: float = number(20.0, 1.0, 1000.0)
    largest_gap_s: float = number(1.0, 0.01, 60.0)
    silence_ratio: float = number(1.0, 0.0, 10.0)
    terrain_m: float = number(5.0, 0.0, 1000.0)

    def __post_init__(self) -> None:
        check_ranges(self)
