"""Settings of the assembly of a session: ground stations, ranks, assumptions."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import field

from groundstation.base.dataclasses import dataclass
from groundstation.base.datums import BY_NAME
from groundstation.base.errors import SettingsError
from groundstation.base.local_frame import LocalFrame
from groundstation.base.toml_settings import check_ranges, number, required_number

WGS_84 = "WGS-84"


@dataclass(frozen=True)
class Station:
    """Ground reference point; on the WGS-84 ellipsoid, unless the file states another datum.

    ``position_sigma_m`` holds along each horizontal axis.
    """

    name: str
    latitude_deg: float = required_number(-90.0, 90.0)
    longitude_deg: float = required_number(-180.0, 180.0)
    altitude_ellipsoid_m: float = required_number(-1000.0, 10_000.0)
    position_sigma_m: float = number(0.0, 0.0)
    rank: int = number(0, 0, 1000)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class Stations:
    """Ground stations of a session; the content of a stations file.

    Parameters
    ----------
    stations : tuple of Station
    origin : LocalFrame, optional
        With it the session is worked in the plane through it (7 states an aircraft), else on the globe (13).
    ranks : mapping of str to int
        Ranks of accuracy of the aircraft, 0 the highest.
    datum : str
        Datum of the latitudes and longitudes of the stations: WGS-84, or one of ``base.datums``. Heights are above the
        ellipsoid of WGS-84 all the same, and the origin is in WGS-84.
    """

    stations: tuple[Station, ...] = ()
    origin: LocalFrame | None = None
    ranks: Mapping[str, int] = field(default_factory=dict)
    datum: str = WGS_84

    def __post_init__(self) -> None:
        if self.datum != WGS_84 and self.datum not in BY_NAME:
            raise SettingsError("datum", repr(self.datum), f"one of {', '.join((WGS_84, *BY_NAME))}")
        twice = [name for name, count in Counter(one.name for one in self.stations).items() if count > 1]
        if twice:
            raise SettingsError("stations", f"{twice[0]!r} more than once", "names that differ")


@dataclass(frozen=True)
class SessionSettings:
    """Assumptions of the assembly of a session about its logs.

    Parameters
    ----------
    range_sigma_m, satellite_range_sigma_m : float
        Sigma of one pseudo-range over the link, and to a satellite: no log tells them.
    epoch_s : float
        Dead reckoning is thinned to this step.
    clock_limit_s : float
        Clocks in UTC that are nearer to each other are left as they are; a larger step is a leap.
    station_limit_m : float
        A station is far when the median residual of every aircraft that hears it is larger.
    negative_limit_m : float
        Clocks can make a one-way range negative; one below this is left out.
    two_way : bool
        Ranges go there and back: no clock is in them.
    """

    range_sigma_m: float = number(10.0, 1e-3)
    satellite_range_sigma_m: float = number(5.0, 1e-3)
    epoch_s: float = number(1.0, 0.01, 60.0)
    clock_limit_s: float = number(0.25, 0.001, 3600.0)
    station_limit_m: float = number(10_000.0, 1.0)
    negative_limit_m: float = number(30_000.0, 0.0)
    two_way: bool = False

    def __post_init__(self) -> None:
        check_ranges(self)
