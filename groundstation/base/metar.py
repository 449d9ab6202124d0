"""Wind of METAR lines: direction it blows from (degrees true), speed, gusts, variation.

Source: WMO-No. 306, Manual on Codes, volume I.1, FM 15 METAR: CCCC YYGGggZ (AUTO) dddffGfmfm dndndnVdxdxdx.
"""

import math
import re
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta

from groundstation.base.dataclasses import dataclass
from groundstation.base.units import NS_PER_S

MPS_PER: dict[str, float] = {"KT": 1852.0 / 3600.0, "MPS": 1.0, "KMH": 1.0 / 3.6}
REPORT_SIGMA_MPS = 1.5  # either component: wind at the mast, minutes away, against the wind at the aircraft
_HEAD = re.compile(
    r"(?<![A-Z0-9])(?P<station>[A-Z][A-Z0-9]{3})\s+(?P<day>\d\d)(?P<hour>\d\d)(?P<minute>\d\d)Z(?P<rest>.*)"
)
_DATE = re.compile(r"(?<!\d)(?P<year>19\d\d|20\d\d)[-/.]?(?P<month>\d\d)[-/.]?\d\d")
_WIND = re.compile(
    r"^\s*(?:(?:AUTO|COR|RTD|AMD|CC[A-Z])\s+)*(?P<from>\d{3}|VRB)\s?P?(?P<speed>\d{2,3})(?:G\s?P?(?P<gust>\d{2,3}))?\s?"
    r"(?P<unit>KMH|KT|MPS)(?![A-Z])(?:\s+(?P<least>\d{3})V(?P<most>\d{3}))?"
)


@dataclass(frozen=True)
class MetarWind:
    """Wind of one line: velocity of the air, m/s, and the sigma of either component.

    ``year_month`` is that of a date which stands before the report on the line; a METAR itself has the day alone.
    """

    station: str
    day: int
    hour: int
    minute: int
    north_mps: float
    east_mps: float
    sigma_mps: float
    year_month: tuple[int, int] | None = None

    @property
    def name(self) -> str:
        """Station, day and time, as in the line."""
        return f"{self.station} {self.day:02d}{self.hour:02d}{self.minute:02d}Z"

    def utc_ns(self, near_ns: int) -> int | None:
        """Return the time of the report in the month that puts it nearest to ``near_ns``.

        A METAR gives the day and the time, not the month. It is None where no such day exists.
        """
        near = datetime.fromtimestamp(near_ns / NS_PER_S, UTC)
        middle = near.replace(day=15)
        months = [(one.year, one.month) for one in (middle - timedelta(30), middle, middle + timedelta(30))]
        found = []
        for year, month in (self.year_month,) if self.year_month else months:
            try:
                found.append(datetime(year, month, self.day, self.hour, self.minute, tzinfo=UTC))
            except ValueError:
                continue
        if not found:
            return None
        return int(min(found, key=lambda one: abs(one - near)).timestamp()) * NS_PER_S


def metar_wind(line: str) -> MetarWind | None:
    """Read the wind of a METAR or SPECI line; None where the line has none that is known.

    Remarks, trends and forecasts are not looked at: the wind stands right behind the time.

    Examples
    --------
    >>> wind = metar_wind("METAR UUEE 040600Z 27010MPS 9999 BKN030 12/05 Q1013 NOSIG=")
    >>> wind.name, round(wind.north_mps, 6), wind.east_mps, wind.sigma_mps
    ('UUEE 040600Z', 0.0, 10.0, 1.5)
    >>> metar_wind("UUEE 040600Z AUTO /////KT CAVOK") is None, metar_wind("TAF UUEE 040500Z 0406/0506 27010MPS") is None
    (True, True)
    """
    head = _HEAD.search(line.upper())
    wind = _WIND.match(head["rest"]) if head else None
    if head is None or wind is None:
        return None
    hour, minute, day = int(head["hour"]), int(head["minute"]), int(head["day"])
    if hour > 23 or minute > 59 or not 1 <= day <= 31:
        return None
    scale = MPS_PER[wind["unit"]]
    speed = scale * int(wind["speed"])
    gusting = max(scale * int(wind["gust"] or 0) - speed, 0.0)
    date = _DATE.search(line[: head.start()])
    dated = (int(date["year"]), int(date["month"])) if date else None
    when = head["station"], day, hour, minute
    if wind["from"] == "VRB":  # as fast as it says, in any direction
        return MetarWind(*when, 0.0, 0.0, math.hypot(REPORT_SIGMA_MPS, speed / math.sqrt(2.0), 0.5 * gusting), dated)
    if int(wind["from"]) > 360:
        return None
    turning = 0.0
    if wind["least"]:  # half the sector to either side, two sigma
        turning = (
            0.5 * speed * math.sin(math.radians(min(0.5 * ((int(wind["most"]) - int(wind["least"])) % 360), 90.0)))
        )
    from_rad = math.radians(int(wind["from"]))
    sigma = math.hypot(REPORT_SIGMA_MPS, 0.5 * gusting, turning)
    return MetarWind(*when, -speed * math.cos(from_rad), -speed * math.sin(from_rad), sigma, dated)


def metar_winds(lines: Iterable[str]) -> tuple[MetarWind, ...]:
    """Read the winds of all lines that have one.

    A later line of the same station and time corrects an earlier one.
    """
    found = {}
    for line in lines:
        wind = metar_wind(line)
        if wind is not None:
            found[(wind.station, wind.year_month, wind.day, wind.hour, wind.minute)] = wind
    return tuple(found.values())


def nearest_wind(
    winds: Iterable[MetarWind], at_ns: int, longest_ns: int, station: str = ""
) -> tuple[MetarWind | None, int | None]:
    """Return the wind nearest in time within ``longest_ns``, and its distance in nanoseconds.

    Where a station is named, its reports alone count. The distance is that of the nearest report even where it is too
    far, None without any.
    """
    near = []
    for wind in winds:
        time_ns = wind.utc_ns(at_ns)
        if time_ns is not None and station in ("", wind.station):
            near.append((abs(time_ns - at_ns), wind))
    if not near:
        return None, None
    away_ns, wind = min(near, key=lambda pair: pair[0])
    return (wind if away_ns <= longest_ns else None), away_ns
