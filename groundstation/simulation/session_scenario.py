"""Scenarios of a session of several aircraft, as frozen dataclasses read from TOML."""

from dataclasses import field
from pathlib import Path
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.toml_settings import check_ranges, number, required_number, settings_from
from groundstation.simulation.satellites import orbit_of

_SESSIONS = ShippedToml("groundstation.simulation", "sessions", "session")
MOST_AIRCRAFT = 100


@dataclass(frozen=True)
class SessionTurn:
    """A turn at constant speed; to the right positive."""

    at_s: float = required_number(0.0)
    rate_dps: float = number(3.0, -30.0, 30.0)
    duration_s: float = number(60.0, 0.0)


@dataclass(frozen=True)
class SessionAircraft:
    """One aircraft: start (north and east of the origin), flight, reception.

    ``satellites`` are names of shipped orbits; one below the mask is not received. ``rank`` 0 is the highest;
    ``hears`` are names of those whose slots it uses, empty for all.
    """

    name: str
    north_m: float = required_number()
    east_m: float = required_number()
    height_m: float = number(10_000.0, -500.0, 30_000.0)
    speed_mps: float = number(220.0, 0.0, 1000.0)
    track_deg: float = number(0.0, -360.0, 360.0)
    rank: int = number(1, 0, 100)
    appears_s: float = number(0.0, 0.0)
    leaves_s: float = number(1e9, 0.0)
    satellites: tuple[str, ...] = ()
    hears: tuple[str, ...] = ()
    turns: tuple[SessionTurn, ...] = ()


@dataclass(frozen=True)
class SessionPoint:
    """Ground reference point.

    ``position_sigma_m`` is the error of its own position, along each axis.
    """

    name: str
    north_m: float = required_number()
    east_m: float = required_number()
    height_m: float = number(0.0, -500.0, 9000.0)
    position_sigma_m: float = number(0.0, 0.0)
    rank: int = number(0, 0, 100)
    appears_s: float = number(0.0, 0.0)
    leaves_s: float = number(1e9, 0.0)


@dataclass(frozen=True)
class SessionErrorSigmas:
    """Sigmas of the errors at the start and of the processes that drive them.

    Global frame: tilt, azimuth and gyro drifts of an INS (full error propagation); local frame: velocity errors are
    Gauss-Markov processes of ``velocity_s``. Clocks: offset at the start, and a Gauss-Markov frequency offset.
    ``has_separate_clocks``: satellite receiver and link have clocks of their own.
    """

    position_m: float = number(300.0, 0.0)
    velocity_mps: float = number(0.2, 0.0)
    velocity_s: float = number(1000.0, 1.0)
    tilt_arcsec: float = number(4.0, 0.0)
    azimuth_arcmin: float = number(5.0, 0.0)
    gyro_dph: float = number(0.01, 0.0)
    gyro_s: float = number(3600.0, 1.0)
    baro_m: float = number(10.0, 0.0)
    baro_s: float = number(3600.0, 1.0)
    clock_m: float = number(30.0, 0.0)
    clock_mps: float = number(3.0, 0.0)
    clock_s: float = number(3600.0, 1.0)
    has_separate_clocks: bool = False


@dataclass(frozen=True)
class LinkSettings:
    """The data link: a frame of slots, one transmitter a slot, all others receive.

    ``quantum_m`` rounds pseudo-ranges; ``lost_share`` of the receptions is lost at random, ``outlier_share`` is wrong
    by ``outlier_m`` (one sigma). ``bias_m`` is the sigma of a constant bias of each receiver.
    """

    range_sigma_m: float = number(10.0, 0.0)
    frame_s: float = number(1.0, 0.01, 600.0)
    slot_s: float = number(0.1, 0.001, 60.0)
    quantum_m: float = number(0.0, 0.0)
    lost_share: float = number(0.0, 0.0, 1.0)
    outlier_share: float = number(0.0, 0.0, 1.0)
    outlier_m: float = number(1000.0, 0.0)
    bias_m: float = number(0.0, 0.0)


@dataclass(frozen=True)
class SatelliteSettings:
    """Satellite receiver: one set of pseudo-ranges at the start of every frame."""

    range_sigma_m: float = number(5.0, 0.0)
    mask_deg: float = number(5.0, 0.0, 89.0)
    start_utc: str = "2018-03-05T12:00:00Z"


@dataclass(frozen=True)
class SessionScenario:
    """Scenario of a session: everything that determines it but the seed.

    Parameters
    ----------
    frame : {'ecef', 'local'}
        Global frame with 13 error states an aircraft, or local with 7.
    latitude_deg, longitude_deg : float
        Place of the origin; only the global frame has them.
    """

    title: str
    frame: Literal["ecef", "local"]
    aircraft: tuple[SessionAircraft, ...]
    duration_s: float = number(600.0, 1.0, 100_000.0)
    epoch_s: float = number(1.0, 0.01, 60.0)
    latitude_deg: float = number(56.0, -85.0, 85.0)
    longitude_deg: float = number(38.0, -180.0, 180.0)
    notes: str = ""
    points: tuple[SessionPoint, ...] = ()
    errors: SessionErrorSigmas = field(default_factory=SessionErrorSigmas)
    link: LinkSettings = field(default_factory=LinkSettings)
    satellite: SatelliteSettings = field(default_factory=SatelliteSettings)

    def __post_init__(self) -> None:
        check_ranges(self)
        names = [one.name for one in self.aircraft] + [point.name for point in self.points]
        if not 1 <= len(self.aircraft) <= MOST_AIRCRAFT:
            raise SettingsError("aircraft", f"{len(self.aircraft)} aircraft", f"1 to {MOST_AIRCRAFT}")
        if len(set(names)) < len(names):
            raise SettingsError("aircraft", "a name that stands twice", "one name for each aircraft and point")
        for one in self.aircraft:
            for name in one.satellites:
                orbit_of(name)
            if self.frame == "local" and one.satellites:
                raise SettingsError("frame", "satellites in a local frame", 'frame = "ecef"')
        if self.slots * self.link.slot_s > self.link.frame_s + 1e-9:
            raise SettingsError(
                "link.frame_s", f"{self.link.frame_s:g} s", f"room for {self.slots} slots of {self.link.slot_s:g} s"
            )

    @property
    def slots(self) -> int:
        """Slots of a frame: one for each aircraft and ground point."""
        return len(self.aircraft) + len(self.points)


def session_names() -> tuple[str, ...]:
    """Names of the shipped sessions."""
    return _SESSIONS.names()


def load_session(name_or_path: str | Path) -> SessionScenario:
    """A shipped session by name, or a user's by the path of its TOML file.

    Raises
    ------
    SettingsError
        For an unknown name, a file that cannot be read, an unknown key or a value out of range.
    """
    file = _SESSIONS.read(name_or_path)
    return settings_from(SessionScenario, file.table, file.where)
