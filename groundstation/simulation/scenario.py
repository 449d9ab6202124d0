"""Scenarios: everything that determines a simulated flight.

They are frozen dataclasses read from TOML.
"""

from collections.abc import Iterable
from dataclasses import field, fields
from pathlib import Path
from typing import Any, Literal

from groundstation.base.angles import wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, SettingsError
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.signals import TOPICS, field_of
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.toml_settings import number, required_number, settings_from
from groundstation.simulation.faults import Fault
from groundstation.simulation.ins_class import ins_class_names
from groundstation.simulation.landing_settings import AdfSettings, RadioAltimeterSettings, RunwayOfLanding
from groundstation.simulation.legs import Leg

_SCENARIOS = ShippedToml("groundstation.simulation", "scenarios", "scenario")
Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Airport:
    """The stand: position on WGS-84 of the middle of the main-gear axle, parked."""

    latitude_deg: float = required_number(-89.0, 89.0)
    longitude_deg: float = required_number(-180.0, 180.0)
    altitude_ellipsoid_m: float = number(0.0, -500.0, 6_000.0)


@dataclass(frozen=True)
class ParkingReference:
    """Reference heading of the stand as a theodolite measured it.

    It is the true heading plus ``error_deg``.
    """

    error_deg: float = number(0.0, -5.0, 5.0)
    sigma_deg: float = number(0.02, 0.0, 5.0)
    logged: bool = True


@dataclass(frozen=True)
class Wind:
    """Velocity of the air over the ground, constant, in the direction to which it blows."""

    north_mps: float = number(0.0, -60.0, 60.0)
    east_mps: float = number(0.0, -60.0, 60.0)


@dataclass(frozen=True)
class GroundMotion:
    """Motion that taxiing adds to the planned track.

    ``sway`` is heading about the track (tyres and gear give way), ``steering`` a slow wander of track and heading
    together, ``sideslip_deg`` a constant angle of the nose to the right of the track, parked position included.
    ``crosswind_slip_deg_per_mps`` turns the nose into the wind, so that it changes sign on the way back.
    """

    sway_sigma_deg: float = number(0.5, 0.0, 5.0)
    sway_frequency_hz: float = number(0.4, 0.01, 3.0)
    sway_damping: float = number(0.1, 0.001, 0.95)
    steering_sigma_deg: float = number(0.3, 0.0, 5.0)
    steering_frequency_hz: float = number(0.05, 0.005, 1.0)
    steering_damping: float = number(0.7, 0.01, 0.95)
    sideslip_deg: float = number(0.0, -5.0, 5.0)
    crosswind_slip_deg_per_mps: float = number(0.0, -1.0, 1.0)


@dataclass(frozen=True)
class InsSettings:
    """Inertial navigator. Error = reading - truth; horizontal channels north, east.

    ``boresight_deg`` is a mounting error: the unit's forward axis to the right of the aircraft's. ``roll_error_deg``
    and ``pitch_error_deg`` are constant; ``attitude_wander_deg`` is the sigma of a Gauss-Markov process of each.
    ``tilt_arcsec`` is positive where it makes the velocity error fall (design of system 2), ``drift_dph`` likewise.
    ``error_model`` "schuler" is the closed solution of the figures given here; "full" draws all errors from
    ``ins_class`` and propagates them along the flight: azimuth, velocity, tilt, drift and position given here are then
    not read, mounting and noise are. ``turns_velocity``: the azimuth error of the closed solution turns every change of
    velocity, as it does in a real navigator; without it turns show an azimuth error of zero.
    """

    rate_hz: float = number(50.0, 0.01, 1000.0)
    error_model: Literal["schuler", "full"] = "schuler"
    turns_velocity: bool = False
    ins_class: str = "navigation"
    azimuth_error_deg: float = number(1.0, -180.0, 180.0)
    azimuth_drift_dph: float = number(0.05, -600.0, 600.0)
    boresight_deg: float = number(0.0, -10.0, 10.0)
    roll_error_deg: float = number(0.0, -10.0, 10.0)
    pitch_error_deg: float = number(0.0, -10.0, 10.0)
    attitude_wander_deg: float = number(0.0, 0.0, 5.0)
    attitude_wander_s: float = number(300.0, 0.0, 100_000.0)
    heading_noise_deg: float = number(0.005, 0.0, 5.0)
    attitude_noise_deg: float = number(0.005, 0.0, 5.0)
    velocity_noise_mps: float = number(0.01, 0.0, 5.0)
    velocity_error_mps: tuple[float, float] = (0.1, -0.1)
    tilt_arcsec: tuple[float, float] = (10.0, -10.0)
    drift_dph: tuple[float, float] = (0.01, -0.01)
    position_error_m: tuple[float, float] = (3.0, -2.0)
    align_s: float = number(0.0, 0.0)
    heading_resolution_deg: float = number(0.001, 1e-6, 1.0)
    attitude_resolution_deg: float = number(0.001, 1e-6, 1.0)
    rate_resolution_dps: float = number(0.001, 1e-6, 1.0)
    velocity_resolution_mps: float = number(0.001, 1e-6, 1.0)
    position_resolution_deg: float = number(1e-7, 1e-10, 0.01)
    altitude_resolution_m: float = number(0.1, 1e-4, 100.0)
    fields: tuple[str, ...] = ()


@dataclass(frozen=True)
class LogInterval:
    """An interval of log seconds, end not included."""

    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)


@dataclass(frozen=True)
class GnssSettings:
    """GNSS receiver.

    Errors are white + first-order Gauss-Markov per axis; vertical ones are ``vertical_factor`` times larger. ``repeat``
    rows of the log carry each receiver output (a recorder faster than the receiver); ``latency_s`` delays the record
    behind the time of validity. Low-integrity intervals clear ``integrity_ok`` and add ``jump_mps`` east.
    """

    rate_hz: float = number(10.0, 0.01, 100.0)
    velocity_white_mps: float = number(0.05, 0.0, 10.0)
    velocity_correlated_mps: float = number(0.025, 0.0, 10.0)
    velocity_correlation_s: float = number(5.0, 0.0, 10_000.0)
    position_white_m: float = number(0.5, 0.0, 1000.0)
    position_correlated_m: float = number(2.0, 0.0, 1000.0)
    position_correlation_s: float = number(300.0, 0.0, 100_000.0)
    vertical_factor: float = number(1.5, 0.0, 10.0)
    antenna_forward_m: float = number(4.0, -100.0, 100.0)
    antenna_right_m: float = number(0.0, -100.0, 100.0)
    antenna_down_m: float = number(-2.0, -100.0, 100.0)
    latency_s: float = number(0.0, 0.0, 10.0)
    repeat: int = number(1, 1, 50)
    gdop: float = number(1.5, 0.5, 50.0)
    satellites: int = number(16, 0, 100)
    constellation: str = "GPS+GLONASS"
    outages: tuple[LogInterval, ...] = ()
    low_integrity: tuple[LogInterval, ...] = ()
    jump_mps: float = number(0.0, -100.0, 100.0)
    velocity_resolution_mps: float = number(0.001, 1e-6, 1.0)
    position_resolution_deg: float = number(1e-7, 1e-10, 0.01)
    altitude_resolution_m: float = number(0.01, 1e-4, 100.0)
    track_resolution_deg: float = number(0.001, 1e-6, 1.0)
    fields: tuple[str, ...] = ()


@dataclass(frozen=True)
class Anomaly:
    """Plane wave of the field of the crust.

    ``amplitude_nt`` is that at the altitude flown, the phase that of the stand.
    """

    amplitude_nt: float = required_number(0.0, 100_000.0)
    wavelength_m: float = required_number(100.0, 1e7)
    direction_deg: float = number(0.0, -360.0, 360.0)
    phase_deg: float = number(0.0, -360.0, 360.0)


@dataclass(frozen=True)
class MagnetometerSettings:
    """Three-axis magnetometer; vectors are of body axes.

    See :func:`groundstation.simulation.magnetometer.sensed_nt`. The field is the World Magnetic Model's of the date
    (``decimal_year``, or that of ``start_utc``) and place, or ``world_field_nt`` (north, east, down) everywhere;
    ``field_error_nt`` (north, east, down) and ``anomaly`` are what the world has more. ``misalignment_deg`` are roll,
    pitch, heading of the sensor in the aircraft. ``bank_odd_nt`` and ``bank_even_nt`` move with the bank (control rods,
    fuel), as sin(roll) and its square. ``latency_s`` delays the record behind the time of validity. Noise per axis:
    white + first-order Gauss-Markov.
    """

    rate_hz: float = number(10.0, 0.01, 1000.0)
    hard_iron_nt: Vector = (300.0, -200.0, 100.0)
    soft_iron: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    misalignment_deg: Vector = ZERO
    scale: Vector = (1.0, 1.0, 1.0)
    current_nt_per_a: Vector = ZERO
    bank_odd_nt: Vector = ZERO
    bank_even_nt: Vector = ZERO
    noise_nt: float = number(30.0, 0.0, 10_000.0)
    correlated_nt: float = number(0.0, 0.0, 10_000.0)
    correlation_s: float = number(60.0, 0.0, 100_000.0)
    latency_s: float = number(0.0, 0.0, 10.0)
    resolution_nt: float = number(1.0, 1e-3, 1000.0)
    decimal_year: float | None = number(None, 2010.0, 2030.0)
    world_field_nt: Vector | None = None
    field_error_nt: Vector = ZERO
    anomaly: Anomaly | None = None


@dataclass(frozen=True)
class Load(LogInterval):
    """Consumer of current that is on for an interval."""

    current_a: float = required_number(-10_000.0, 10_000.0)


@dataclass(frozen=True)
class ElectricSettings:
    """Electric system: ``base_a`` all the time, ``loads`` on top.

    Its magnetic field is part of the magnetometer.
    """

    rate_hz: float = number(5.0, 0.01, 1000.0)
    base_a: float = number(0.0, -10_000.0, 10_000.0)
    loads: tuple[Load, ...] = ()
    noise_a: float = number(0.2, 0.0, 1000.0)
    resolution_a: float = number(0.1, 1e-4, 100.0)


@dataclass(frozen=True)
class BaroSettings:
    """Barometric altimeter: ellipsoid altitude + offset + noise.

    The atmosphere is taken as standard.
    """

    rate_hz: float = number(1.0, 0.01, 100.0)
    offset_m: float = number(-15.0, -1000.0, 1000.0)
    noise_m: float = number(0.5, 0.0, 100.0)
    resolution_m: float = number(0.1, 1e-3, 100.0)


@dataclass(frozen=True)
class AirSettings:
    """Air data: true airspeed, and the wind when ``with_wind``."""

    rate_hz: float = number(2.0, 0.01, 100.0)
    airspeed_noise_mps: float = number(0.3, 0.0, 50.0)
    wind_noise_mps: float = number(0.5, 0.0, 50.0)
    resolution_mps: float = number(0.01, 1e-4, 10.0)
    with_wind: bool = False


@dataclass(frozen=True)
class DiscreteSettings:
    """Weight-on-wheels switch."""

    rate_hz: float = number(10.0, 0.01, 1000.0)


@dataclass(frozen=True)
class OnboardSettings:
    """Estimate of the aircraft itself: the paper's recursion at its cycle rate.

    It uses the last GNSS and INS outputs. Cycles reuse GNSS samples when faster than the receiver; the heading rate is
    the raw difference between INS outputs.
    """

    cycle_rate_hz: float = number(20.0, 0.1, 100.0)
    log_rate_hz: float = number(1.0, 0.01, 100.0)
    speed_gate_mps: float = number(6.0, 0.0, 50.0)
    heading_rate_gate_dps: float = number(3.0, 0.01, 100.0)
    entry_step_deg: float = number(0.1, 1e-3, 1.0)
    resolution_deg: float = number(0.001, 1e-6, 1.0)


@dataclass(frozen=True)
class TruthSettings:
    """Settings of the truth: always in the tables, in the CSV only when ``written``."""

    rate_hz: float = number(10.0, 0.01, 1000.0)
    written: bool = False


@dataclass(frozen=True)
class EventMarker:
    """Marker of the recorder, or an operator's command."""

    time_s: float = required_number(0.0)
    name: str = ""


@dataclass(frozen=True)
class LogSettings:
    """Format of the flat CSV.

    ``cut_bytes`` are missing at its end, as after a loss of power.
    """

    delimiter: Literal[",", ";", "\t"] = ","
    encoding: Literal["utf-8", "cp1251"] = "utf-8"
    cut_bytes: int = number(0, 0)
    notes: str = ""


@dataclass(frozen=True)
class Scenario:
    """Simulated flight.

    Sensors that a scenario does not name are off, except INS, GNSS and weight on wheels. ``start_utc`` is the UTC of
    log second 0; empty means that the log has no absolute time (NOTIME). ``parking_heading_deg`` is the true heading of
    the nose at the stand; ``expected_verdict`` what an analysis of the taxi should come to. All rates divide
    ``internal_rate_hz``.
    """

    name: str
    airport: Airport
    legs: tuple[Leg, ...]
    title: str = ""
    expected_verdict: Literal["", "accept", "advisory", "reject", "extend", "undecided"] = ""
    aircraft: str = "SIM-1"
    flight: str = ""
    start_utc: str = ""
    seed: int = number(1, 0)
    internal_rate_hz: float = number(100.0, 10.0, 1000.0)
    parking_heading_deg: float = number(0.0, 0.0, 360.0)
    reference: ParkingReference = field(default_factory=ParkingReference)
    wind: Wind = field(default_factory=Wind)
    ground: GroundMotion = field(default_factory=GroundMotion)
    ins: InsSettings = field(default_factory=InsSettings)
    gnss: GnssSettings = field(default_factory=GnssSettings)
    discrete: DiscreteSettings = field(default_factory=DiscreteSettings)
    magnetometer: MagnetometerSettings | None = None
    electric: ElectricSettings | None = None
    baro: BaroSettings | None = None
    air: AirSettings | None = None
    onboard: OnboardSettings | None = None
    runway: RunwayOfLanding = field(default_factory=RunwayOfLanding)
    adf: AdfSettings | None = None
    radio_altimeter: RadioAltimeterSettings | None = None
    truth: TruthSettings = field(default_factory=TruthSettings)
    events: tuple[EventMarker, ...] = ()
    faults: tuple[Fault, ...] = ()
    log: LogSettings = field(default_factory=LogSettings)

    @property
    def start_utc_ns(self) -> int | None:
        """UTC of log second 0, nanoseconds since 1970; None without absolute time."""
        return iso_to_utc_ns(self.start_utc)[0] if self.start_utc else None

    @property
    def reference_heading_deg(self) -> float:
        """Heading of the stand as the reference gives it, with the reference's own error."""
        return float(wrap_360(self.parking_heading_deg + self.reference.error_deg))


def scenario_names() -> tuple[str, ...]:
    """Names of the shipped scenarios, in alphabetical order.

    Examples
    --------
    >>> "taxi-good" in scenario_names()
    True
    """
    return _SCENARIOS.names()


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Load a shipped scenario by name, or a scenario file (``.toml``) by path.

    Raises
    ------
    SettingsError
        Naming the file and the key that cannot be used.

    Examples
    --------
    >>> load_scenario("taxi-good").ins.azimuth_error_deg
    1.2
    """
    file = _SCENARIOS.read(name_or_path)
    return scenario_from_table(file.table, file.name, file.where)


def scenario_from_table(table: dict[str, Any], name: str, where: str) -> Scenario:
    """Make a scenario of a TOML table, and check what one key cannot show.

    These are rates, intervals and the start time.
    """
    scenario = settings_from(Scenario, {"name": name} | table, where)
    if not scenario.legs:
        raise SettingsError(f"{where}, key legs", "no leg", "one or more")
    try:
        _ = scenario.start_utc_ns
    except GroundstationError as error:
        raise SettingsError(f"{where}, key start_utc", error.found, error.expected) from error
    for part in (item for item in fields(scenario) if item.name not in ("legs", "faults")):
        value = getattr(scenario, part.name)
        for key in ("rate_hz", "cycle_rate_hz", "log_rate_hz"):
            if hasattr(value, key):
                _check_rate(getattr(value, key), scenario.internal_rate_hz, f"{where}, key {part.name}.{key}")
    _check_rate(scenario.gnss.rate_hz * scenario.gnss.repeat, scenario.internal_rate_hz, f"{where}, key gnss.repeat")
    for topic, settings in (("ins", scenario.ins), ("gnss", scenario.gnss)):
        for name in settings.fields:
            if field_of(topic, name) is None:
                names = ", ".join(item.name for item in TOPICS[topic])
                raise SettingsError(f"{where}, key {topic}.fields", repr(name), f"some of {names}")
    if scenario.ins.error_model == "full" and scenario.ins.ins_class not in ins_class_names():
        found, expected = repr(scenario.ins.ins_class), f"one of {', '.join(ins_class_names())}"
        raise SettingsError(f"{where}, key ins.ins_class", found, expected)
    _check_intervals(scenario.gnss.outages, f"{where}, key gnss.outages")
    _check_intervals(scenario.gnss.low_integrity, f"{where}, key gnss.low_integrity")
    if scenario.magnetometer and any(scenario.magnetometer.current_nt_per_a) and scenario.electric is None:
        place, expected = f"{where}, key magnetometer.current_nt_per_a", "a table [electric] beside it"
        raise SettingsError(place, "a coupling and no current", expected)
    _check_intervals(scenario.electric.loads if scenario.electric else (), f"{where}, key electric.loads")
    _check_intervals([fault for fault in scenario.faults if hasattr(fault, "to_s")], f"{where}, key faults")
    return scenario


def _check_intervals(intervals: Iterable[Any], place: str) -> None:
    for interval in intervals:
        if interval.to_s <= interval.from_s:
            raise SettingsError(place, f"end {interval.to_s:g} s", f"an end after the start {interval.from_s:g} s")


def _check_rate(rate_hz: float, internal_rate_hz: float, place: str) -> None:
    ratio = internal_rate_hz / rate_hz
    if ratio < 1.0 or abs(ratio - round(ratio)) > 1e-9:
        raise SettingsError(place, f"{rate_hz:g} Hz", f"a divisor of the internal rate {internal_rate_hz:g} Hz")
