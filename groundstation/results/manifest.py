"""manifest.json: time, place and versions of a run, and results a later run can reuse."""

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.serial import LEFT_OUT_WHEN_DEFAULT


@dataclass(frozen=True)
class SourceOfRun:
    """The log as the run found it; ``path`` is a URL for a log that was fetched."""

    path: str = ""
    name: str = ""
    sha256: str = ""
    size_bytes: int = 0
    reader: str = ""


@dataclass(frozen=True)
class LogOfSession(SourceOfRun):
    """One log of a session.

    ``mcap`` is its store, beside the manifest where the session converted it.
    """

    mcap: str = ""


@dataclass(frozen=True)
class PartOfRun(SourceOfRun):
    """One of the consecutive logs of a flight, and its start and end.

    Most flights have one.

    Parameters
    ----------
    aircraft, flight : str
        As the log names them; empty where it does not.
    rows : int
        Records of all topics; 0 where the log cannot be read alone.
    utc_ns : (int, int) or None
        UTC of its first and last record.
    device_ns : (int, int)
        The same on the clock of the device.
    places_deg : tuple of (float, float)
        Latitude and longitude where it begins and ends; empty where it does not tell them.
    """

    aircraft: str = ""
    flight: str = ""
    rows: int = 0
    utc_ns: tuple[int, int] | None = None
    device_ns: tuple[int, int] = (0, 0)
    places_deg: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class PowerUpOfRun:
    """Number of the power-up in the log, from 1, and their count."""

    number: int
    count: int


@dataclass(frozen=True)
class Host:
    """The machine of the run."""

    platform: str = ""
    machine: str = ""
    python: str = ""


@dataclass(frozen=True)
class Keys:
    """Keys of the stages of one log's run, hexadecimal; each one covers those before it."""

    conversion: str
    analysis: str


@dataclass(frozen=True)
class Resume:
    """Record that lets a later run skip work: keys of the stages, and what was found.

    The findings are in one line; a flag tells whether data was lost.
    """

    keys: Keys
    text: str
    has_lost_data: bool


@dataclass(frozen=True)
class FileOfRun:
    """File as the run left it: its size in bytes.

    The MCAP has its digest and the time of its last change, too.
    """

    size_bytes: int
    sha256: str = field(default="", metadata=LEFT_OUT_WHEN_DEFAULT)
    time_ns: int = field(default=0, metadata=LEFT_OUT_WHEN_DEFAULT)


@dataclass(frozen=True)
class Manifest:
    """Everything that may differ between two equal runs.

    Parameters
    ----------
    groundstation : str
        Version that made the run.
    made_utc : str
    configuration : mapping
        Settings of the user, table by table, as TOML has it.
    heading_settings : mapping
        Settings of the heading correction in force.
    versions : mapping of package to version
    logs : tuple of LogOfSession
        Logs of a session; absent for a flight.
    is_found : bool
        True where a run found the session among its flights, and may replace it; not what ``cooperative`` made.
    resume : Resume, optional
        Absent where no run made the folder.
    files : mapping of str to FileOfRun
        All others of the folder by their path in it; absent in manifests of earlier versions.
    power_up : PowerUpOfRun, optional
        Absent where the log holds one.
    parts : tuple of PartOfRun
        The consecutive logs of the flight; that of a power-up has none.
    """

    groundstation: str = ""
    flight_id: str = ""
    made_utc: str = ""
    source: SourceOfRun = field(default_factory=SourceOfRun)
    configuration: Mapping[str, Any] = field(default_factory=dict)
    heading_settings: Mapping[str, float | int | str | bool] = field(default_factory=dict)
    host: Host = field(default_factory=Host)
    versions: Mapping[str, str] = field(default_factory=dict)
    logs: tuple[LogOfSession, ...] = field(default=(), metadata=LEFT_OUT_WHEN_DEFAULT)
    is_found: bool = field(default=False, metadata=LEFT_OUT_WHEN_DEFAULT)
    resume: Resume | None = field(default=None, metadata=LEFT_OUT_WHEN_DEFAULT)
    files: Mapping[str, FileOfRun] = field(default_factory=dict, metadata=LEFT_OUT_WHEN_DEFAULT)
    power_up: PowerUpOfRun | None = field(default=None, metadata=LEFT_OUT_WHEN_DEFAULT)
    parts: tuple[PartOfRun, ...] = field(default=(), metadata=LEFT_OUT_WHEN_DEFAULT)
