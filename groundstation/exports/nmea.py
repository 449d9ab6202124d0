"""NMEA 0183 sentences GGA, RMC and HDT of one track, as a receiver would have sent them.

The version is NMEA 0183 version 4.
"""

import math
from pathlib import Path

import numpy as np

from groundstation.base.angles import direction_of, wrap_360
from groundstation.base.errors import NotAssessableError
from groundstation.exports.tracks import MSL, SPEED, Track, number

KNOT_MPS = 1852.0 / 3600.0
AUTONOMOUS = 1  # quality of GGA: a fix, its kind is not said
NS_PER_MS = 1_000_000
MINUTE_DIGITS = 7  # 0.2 mm


def write_nmea(path: Path, track: Track) -> None:
    """Write the sentences of every position.

    Raises
    ------
    NotAssessableError
        For a track without UTC.
    """
    if not track.has_utc:
        raise NotAssessableError(track.name, "no UTC in this flight", "a log with absolute time: RMC has a date")
    with path.open("w", encoding="ascii", newline="") as file:
        for row in range(len(track)):
            file.writelines(_with_checksum(body) for body in _bodies(track, row))


def _bodies(track: Track, row: int) -> list[str]:
    moment = np.datetime64((int(track.time_ns[row]) + NS_PER_MS // 2) // NS_PER_MS, "ms").item()
    clock = f"{moment:%H%M%S}.{moment.microsecond // 1000:03d}"
    place = f"{_angle(float(track.latitude_deg[row]), 2, 'NS')},{_angle(float(track.longitude_deg[row]), 3, 'EW')}"
    satellites, hdop = (float(track.column(name)[row]) for name in ("satellites_used", "hdop"))
    height = number(float(track.column(MSL)[row]), 3)
    used = f"{satellites:02.0f}" if math.isfinite(satellites) else ""
    gga = f"GPGGA,{clock},{place},{AUTONOMOUS},{used},{number(hdop, 2)},{height},{'M' if height else ''},,,,"
    speed = number(float(track.column(SPEED)[row]) / KNOT_MPS, 4)
    rmc = f"GPRMC,{clock},A,{place},{speed},{_course(track, row)},{moment:%d%m%y},,,A"
    heading = _direction(float(track.column("true_heading_deg")[row]))
    return [gga, rmc, *([f"GPHDT,{heading},T"] if heading else [])]


def _course(track: Track, row: int) -> str:
    course = float(track.column("track_deg")[row])
    if not math.isfinite(course):
        north, east = (float(track.column(f"velocity_{axis}_mps")[row]) for axis in ("north", "east"))
        course = float(direction_of(north, east))
    return _direction(course)


def _direction(value_deg: float) -> str:
    """Write degrees from 0 to less than 360, after rounding.

    Examples
    --------
    >>> _direction(359.99999), _direction(-90.0), _direction(math.nan)
    ('0', '270', '')
    """
    return number(float(wrap_360(round(value_deg, 4))), 4)


def _angle(value_deg: float, digits: int, signs: str) -> str:
    """Write degrees and minutes with the hemisphere.

    Examples
    --------
    >>> _angle(-33.5, 2, "NS"), _angle(7.9999999999, 3, "EW")
    ('3330.0000000,S', '00800.0000000,E')
    """
    units = round(abs(value_deg) * 60 * 10**MINUTE_DIGITS)
    whole, rest = divmod(units, 60 * 10**MINUTE_DIGITS)
    minutes = f"{rest // 10**MINUTE_DIGITS:02d}.{rest % 10**MINUTE_DIGITS:0{MINUTE_DIGITS}d}"
    return f"{whole:0{digits}d}{minutes},{signs[value_deg < 0.0]}"


def _with_checksum(body: str) -> str:
    """Return a sentence with its dollar sign, checksum and line end.

    Examples
    --------
    >>> _with_checksum("GPHDT,274.07,T")
    '$GPHDT,274.07,T*03\\r\\n'
    """
    total = 0
    for letter in body.encode("ascii"):
        total ^= letter
    return f"${body}*{total:02X}\r\n"
