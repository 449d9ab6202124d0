"""Settings of simulated landing aids: beacons, direction finder, altimeter, runway.

The altimeter is a radio altimeter.
"""

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import number, required_number


@dataclass(frozen=True)
class SimulatedBeacon:
    """A beacon before the threshold and right of the course."""

    name: str
    before_threshold_m: float = required_number(-20_000.0, 100_000.0)
    right_m: float = number(0.0, -50_000.0, 50_000.0)


@dataclass(frozen=True)
class AdfSettings:
    """Automatic direction finder, one channel for each beacon.

    Errors are white + first-order Gauss-Markov. ``is_reversed`` is a finder whose bearings run the wrong way round, a
    fault.
    """

    beacons: tuple[SimulatedBeacon, ...]
    rate_hz: float = number(5.0, 0.01, 100.0)
    sigma_deg: float = number(1.0, 0.0, 30.0)
    correlated_deg: float = number(0.0, 0.0, 30.0)
    correlation_s: float = number(10.0, 0.0, 10_000.0)
    resolution_deg: float = number(0.01, 1e-6, 10.0)
    longest_range_m: float = number(15_000.0, 100.0, 500_000.0)
    is_reversed: bool = False


@dataclass(frozen=True)
class RadioAltimeterSettings:
    """Radio altimeter: height above the ground, up to ``highest_m``.

    The ground rises ahead of the threshold. ``rise_m_per_km`` raises the ground before the threshold with the distance
    from it.
    """

    rate_hz: float = number(10.0, 0.01, 100.0)
    sigma_m: float = number(0.5, 0.0, 100.0)
    highest_m: float = number(750.0, 1.0, 10_000.0)
    rise_m_per_km: float = number(0.0, -500.0, 500.0)
    resolution_m: float = number(0.1, 1e-4, 100.0)


@dataclass(frozen=True)
class RunwayOfLanding:
    """Place of the threshold against the touchdown."""

    threshold_before_touchdown_m: float = number(450.0, 0.0, 3000.0)
    threshold_right_m: float = number(0.0, -500.0, 500.0)
