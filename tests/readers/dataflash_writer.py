"""A minimal DataFlash encoder, written from ArduPilot's description and apart from the reader."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

MAGIC = b"\xa3\x95"
_PACK = {
    "b": "b",
    "B": "B",
    "M": "B",
    "h": "h",
    "H": "H",
    "i": "i",
    "I": "I",
    "q": "q",
    "Q": "Q",
    "f": "f",
    "d": "d",
    "g": "e",
    "n": "4s",
    "N": "16s",
    "Z": "64s",
    "a": "32h",
    "c": "h",
    "C": "H",
    "e": "i",
    "E": "I",
    "L": "i",
}


@dataclass
class DataFlash:
    """A log as a list of records, each the bytes of one message; values are the stored numbers."""

    records: list[bytes] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    _types: dict[str, tuple[int, str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.define(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")

    def define(self, type_id: int, name: str, characters: str, labels: str, length: int | None = None) -> None:
        """Write a FMT record."""
        self._types[name] = (type_id, characters)
        size = struct.calcsize("<" + "".join(_PACK[character] for character in characters)) + 3
        self.write(
            "FMT", type_id, size if length is None else length, name.encode(), characters.encode(), labels.encode()
        )

    def write(self, name: str, *values: Any) -> None:
        """Write a record of a type that was defined."""
        type_id, characters = self._types.get(name, (128, "BBnNZ"))
        flat: list[Any] = []
        for value in values:
            flat += value if isinstance(value, list) else [value.encode() if isinstance(value, str) else value]
        layout = "<" + "".join(_PACK[character] for character in characters)
        self.records.append(MAGIC + bytes((type_id,)) + struct.pack(layout, *flat))
        self.names.append(name)

    def units(self, name: str, unit_ids: str, multiplier_ids: str) -> None:
        """Write a FMTU record."""
        self.write("FMTU", 0, self._types[name][0], unit_ids, multiplier_ids)

    def define_units(self, units: dict[str, str], multipliers: dict[str, float]) -> None:
        """Write the types FMTU, UNIT and MULT, and their records."""
        self.define(200, "UNIT", "QbZ", "TimeUS,Id,Label")
        self.define(201, "MULT", "Qbd", "TimeUS,Id,Mult")
        self.define(202, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
        for code, text in units.items():
            self.write("UNIT", 0, ord(code), text)
        for code, factor in multipliers.items():
            self.write("MULT", 0, ord(code), factor)

    @property
    def content(self) -> bytes:
        """The file."""
        return b"".join(self.records)

    def starts(self) -> Sequence[int]:
        """Where each record begins, and the size of the file."""
        places = [0]
        for record in self.records:
            places.append(places[-1] + len(record))
        return places


UNITS = {
    "s": "s",
    "d": "deg",
    "D": "deglatitude",
    "U": "deglongitude",
    "m": "m",
    "n": "m/s",
    "G": "Gauss",
    "E": "rad/s",
}
UNITS |= {"#": "instance", "-": "", "h": "degheading", "o": "m/s/s", "A": "A"}
MULTIPLIERS = {"-": 0.0, "0": 1.0, "B": 1e-2, "C": 1e-3, "F": 1e-6, "G": 1e-7}


def flight_log(seconds: int = 4, disarmed: range = range(0), *, has_events: bool = True) -> DataFlash:
    """A log of today's layout: IMU 20 Hz with two instances, ATT, EKF, POS 5 Hz, GPS 2 Hz.

    Nothing is written in the seconds ``disarmed``, but the events at their ends.
    """
    log = DataFlash()
    log.define_units(UNITS, MULTIPLIERS)
    log.define(1, "PARM", "QNff", "TimeUS,Name,Value,Default")
    log.define(2, "MSG", "QZ", "TimeUS,Message")
    log.define(3, "IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    log.define(4, "ATT", "QcccCcC", "TimeUS,DesRoll,Roll,Pitch,Yaw,DesPitch,DesYaw")
    log.define(5, "XKF1", "QBccCfff", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD")
    log.define(6, "XKF4", "QBHbB", "TimeUS,C,SS,GPS,PI")
    log.define(7, "POS", "QLLf", "TimeUS,Lat,Lng,Alt")
    log.define(8, "GPS", "QBBIHBcLLeffffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U")
    log.define(9, "GPA", "QBCCCC", "TimeUS,I,VDop,HAcc,VAcc,SAcc")
    log.define(10, "MAG", "QBhhhB", "TimeUS,I,MagX,MagY,MagZ,Health")
    log.units("IMU", "s#EEEooo", "F-000000")
    log.units("ATT", "sdddhdh", "FBBBBBB")
    log.units("XKF1", "s#ddhnnn", "F-BBB000")
    log.units("GPS", "s#-s--mDUmnhnh-", "F--C-0BGGB0000-")
    log.units("GPA", "s#mmmn", "F-BBBB")
    log.units("MAG", "s#GGG-", "F-CCC-")
    log.units("XKF4", "s#---", "F----")
    log.write("MSG", 1_000_000, "ArduPlane V4.5.7 (0358a9c2)")
    for name, value in (("AHRS_EKF_TYPE", 3.0), ("COMPASS_AUTODEC", 1.0), ("COMPASS_DEC", 0.1), ("RC1_MIN", 1100.0)):
        log.write("PARM", 1_000_100, name, value, value)
    if disarmed:
        log.define(11, "EV", "QB", "TimeUS,Id")
    for tick in range(20 * seconds):
        if has_events and tick in (20 * disarmed.start, 20 * disarmed.stop) and disarmed:
            log.write("EV", 1_100_000 + tick * 50_000 - 60, 11 if tick == 20 * disarmed.start else 10)
        if tick // 20 not in disarmed:
            _tick(log, tick)
    return log


def _tick(log: DataFlash, tick: int) -> None:
    now = 1_100_000 + tick * 50_000
    for instance in (0, 1):
        log.write("IMU", now - 40, instance, 0.1 * instance, 0.01 * tick, -0.5, 0.0, 1.0, -9.8)
    if tick % 4 == 0:
        log.write("ATT", now + 5, 0, 150 + tick, -250, 35_900 + tick, 0, 0)
        for core in (0, 1):
            log.write("XKF1", now + 9, core, 0, 0, 0, 10.0 + core, 1.0, -0.5)
            log.write("XKF4", now + 12, core, 0, 0, 1 if tick >= 40 else 0)
        log.write("POS", now + 20, -353_600_000 + tick, 1_491_600_000, 584.25)
        log.write("MAG", now + 25, 0, 250, -120, 480, 1)
    if tick % 10 == 0:
        fixed = 3 if tick else 1
        week_ms = 200_000_000 + tick * 50
        log.write(
            "GPS",
            now + 100,
            0,
            fixed,
            week_ms,
            2300,
            14,
            77,
            -353_600_001,
            1_491_600_002,
            58_425,
            5.0,
            90.0,
            -0.25,
            0.0,
            1,
        )
        log.write("GPA", now + 100, 0, 120, 80, 150, 30)
