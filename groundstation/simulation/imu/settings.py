"""Settings of a simulated log of an inertial unit with GNSS."""

from dataclasses import field
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import check_ranges, number
from groundstation.simulation.scenario import ZERO, LogInterval, Vector


@dataclass(frozen=True)
class ReceiverSettings:
    """GNSS receiver: errors of position and velocity, their ages, and what it says of them.

    Errors of position are white + slow + fast (first-order Gauss-Markov) in each axis, those of height
    ``vertical_factor`` times larger; velocity likewise. A fix is logged ``latency_s`` after its validity. The stated
    sigmas are the true ones times ``stated_factor``: below 1 the receiver is too sure.
    """

    rate_hz: float = number(5.0, 0.01, 100.0)
    position_white_m: float = number(0.5, 0.0, 1000.0)
    position_slow_m: float = number(1.0, 0.0, 1000.0)
    slow_s: float = number(300.0, 0.1, 1e6)
    position_fast_m: float = number(0.3, 0.0, 1000.0)
    fast_s: float = number(10.0, 0.1, 1e6)
    velocity_white_mps: float = number(0.05, 0.0, 10.0)
    vertical_factor: float = number(1.5, 0.0, 10.0)
    latency_s: float = number(0.0, -10.0, 10.0)
    stated_factor: float = number(1.0, 0.01, 100.0)
    outages: tuple[LogInterval, ...] = ()
    is_precise: bool = False

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class StampSettings:
    """Time stamps of the inertial samples, and samples that are lost.

    ``jitter_s`` is the sigma of a stamp about the true end of its interval; the order is kept, as a queue keeps it.
    ``duplicated`` and ``backward`` are shares of samples: with the stamp of the sample before, and 1.5 intervals before
    it. ``gaps`` are intervals of the log without samples.
    """

    jitter_s: float = number(0.0, 0.0, 1.0)
    duplicated: float = number(0.0, 0.0, 0.5)
    backward: float = number(0.0, 0.0, 0.5)
    gaps: tuple[LogInterval, ...] = ()

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class VibrationSettings:
    """Vibration of the mount: sines near ``frequency_hz``, standard deviations by axis."""

    rate_dps: float = number(0.0, 0.0, 1000.0)
    acceleration_mps2: float = number(0.0, 0.0, 1000.0)
    frequency_hz: float = number(80.0, 1.0, 5000.0)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class MountingSettings:
    """Mounting of the case: its axes are the body's turned by roll, pitch and heading.

    ``axes_deg`` is a turn by quarters, ``small_deg`` a misalignment in it. ``mirrored`` is an axis of the case that
    points the other way: left-handed axes, as bad drivers give them. ``lever_arm_m`` is the antenna from the unit,
    forward, right, down of the body.
    """

    axes_deg: Vector = ZERO
    small_deg: Vector = ZERO
    mirrored: Literal["", "x", "y", "z"] = ""
    lever_arm_m: Vector = (0.5, 0.2, -1.0)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class BarometerSettings:
    """Barometer: pressure altitude with white noise, gusts and a drift.

    Both are Gauss-Markov. Without rate there is none.

    ``scale`` is what the air of the day makes of a climb; ``offset_m`` the weather.
    """

    rate_hz: float = number(0.0, 0.0, 200.0)
    noise_m: float = number(0.2, 0.0, 100.0)
    gust_m: float = number(0.4, 0.0, 100.0)
    gust_s: float = number(5.0, 0.0, 1000.0)
    drift_m: float = number(4.0, 0.0, 1000.0)
    drift_s: float = number(1800.0, 0.1, 1e6)
    scale: float = number(1.02, 0.5, 2.0)
    offset_m: float = number(-40.0, -1000.0, 1000.0)
    latency_s: float = number(0.1, 0.0, 10.0)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class WheelSettings:
    """Speed of the wheels along the nose; without rate there is none."""

    rate_hz: float = number(0.0, 0.0, 200.0)
    scale: float = number(1.015, 0.1, 10.0)
    noise_mps: float = number(0.05, 0.0, 10.0)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class CompassSettings:
    """Magnetometer of three axes in the field of the Earth and of the vehicle.

    Without rate there is none.

    ``deviation_deg`` is A to E of what is to be added to its heading; ``error_deg`` what they leave (Gauss-Markov).
    """

    rate_hz: float = number(0.0, 0.0, 200.0)
    deviation_deg: tuple[float, float, float, float, float] = (1.0, 4.0, -3.0, 1.5, 0.5)
    error_deg: float = number(2.0, 0.0, 45.0)
    error_s: float = number(300.0, 0.1, 1e6)
    noise_nt: float = number(150.0, 0.0, 1e5)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class ImuSettings:
    """Settings of a simulated log: motion, unit, mounting, stamps, receiver, aids.

    ``scale_factor`` and ``misalignment_deg`` are sigmas in place of the class's. ``error_factor`` multiplies every
    error of the unit; 0 is a perfect one. ``is_integral`` false: samples at the ends of the intervals, times the
    interval. ``slip_deg_per_mps2`` is the sideslip of a car in turns.
    """

    duration_s: float = number(600.0, 1.0, 100_000.0)
    rate_hz: float = number(100.0, 1.0, 2000.0)
    latitude_deg: float = number(56.0, -89.0, 89.0)
    longitude_deg: float = number(38.0, -180.0, 180.0)
    height_m: float = number(200.0, -500.0, 20_000.0)
    slip_deg_per_mps2: float = number(0.0, -5.0, 5.0)
    imu_class: str = "mems"
    error_factor: float = number(1.0, 0.0, 100.0)
    scale_factor: float | None = number(None, 0.0, 0.2)
    misalignment_deg: float | None = number(None, 0.0, 10.0)
    is_integral: bool = True
    vibration: VibrationSettings = field(default_factory=VibrationSettings)
    stamps: StampSettings = field(default_factory=StampSettings)
    mounting: MountingSettings = field(default_factory=MountingSettings)
    gnss: ReceiverSettings = field(default_factory=ReceiverSettings)
    barometer: BarometerSettings = field(default_factory=BarometerSettings)
    wheels: WheelSettings = field(default_factory=WheelSettings)
    compass: CompassSettings = field(default_factory=CompassSettings)

    def __post_init__(self) -> None:
        check_ranges(self)
