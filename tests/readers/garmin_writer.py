"""Writes logs of Garmin's panels for tests: an aircraft that flies along a true track at 50 m/s."""

from dataclasses import dataclass

import numpy as np

MPS, M_PER_DEG = 50.0, 111_195.0
KT, FT = MPS / (1852.0 / 3600.0), 100.0 / 0.3048
G3X_TOP = '#airframe_info,log_version="1.00",product="GDU 460",aircraft_ident="N1",software_version="9.52"'
G5_TOP = '#info,log_version="1.00",software_part_number="006-B2304-23",software_version="6.40",serial_number="4"'
G1000_TOP = '#airframe_info, log_version="1.03", airframe_name="X", system_id="Y",'


@dataclass(frozen=True)
class Flight:
    """What the aircraft does, and how the panel tells it.

    Parameters
    ----------
    track_deg, heading_deg : float
        True.
    declination_deg : float
        East positive.
    variation_sign : {1, -1}
        1: the logged variation is positive east.
    track_is_true : bool
    """

    track_deg: float = 90.0
    heading_deg: float = 93.0
    declination_deg: float = 13.0
    variation_sign: int = 1
    track_is_true: bool = True
    latitude_deg: float = 37.7
    longitude_deg: float = -122.2
    rows: int = 60

    def columns(self) -> dict[str, list[str]]:
        """Cells by what they are."""
        at, track_rad = np.arange(self.rows), np.deg2rad(self.track_deg)
        north, east = MPS * np.cos(track_rad), MPS * np.sin(track_rad)
        latitude = self.latitude_deg + north * at / M_PER_DEG
        longitude = self.longitude_deg + east * at / M_PER_DEG / np.cos(np.deg2rad(self.latitude_deg))
        magnetic = (self.heading_deg - self.declination_deg) % 360.0
        track = self.track_deg if self.track_is_true else (self.track_deg - self.declination_deg) % 360.0
        constant = {
            "offset": "-07:00",
            "altitude": f"{FT:.1f}",
            "speed": f"{KT:.3f}",
            "track": f"{track:.2f}",
            "east": f"{east:.3f}",
            "north": f"{north:.3f}",
            "up": "1.5",
            "heading": f"{magnetic:.2f}",
            "variation": f"{self.variation_sign * self.declination_deg:.1f}",
            "pitch": "1.5",
            "roll": "-0.5",
            "normal": "1.00",
        }
        return {name: [value] * self.rows for name, value in constant.items()} | {
            "date": ["2024-05-06"] * self.rows,
            "time": [f"03:{second // 60:02d}:{second % 60:02d}" for second in at],
            "utc": [f"10:{second // 60:02d}:{second % 60:02d}" for second in at],
            "latitude": [f"{one:.7f}" for one in latitude],
            "longitude": [f"{one:.7f}" for one in longitude],
        }


G3X = {
    "date": ("Date (yyyy-mm-dd)", "Lcl Date"),
    "time": ("Time (hh:mm:ss)", "Lcl Time"),
    "utc": ("UTC Time (hh:mm:ss)", "UTC Time"),
    "offset": ("UTC Offset (hh:mm)", "UTCOfst"),
    "latitude": ("Latitude (deg)", "Latitude"),
    "longitude": ("Longitude (deg)", "Longitude"),
    "altitude": ("GPS Altitude (ft)", "AltGPS"),
    "speed": ("GPS Ground Speed (kt)", "GndSpd"),
    "track": ("GPS Ground Track (deg)", "TRK"),
    "east": ("GPS Velocity E (m/sec)", "GPSVelE"),
    "north": ("GPS Velocity N (m/sec)", "GPSVelN"),
    "up": ("GPS Velocity U (m/sec)", "GPSVelU"),
    "heading": ("Magnetic Heading (deg)", "HDG"),
    "pitch": ("Pitch (deg)", "Pitch"),
    "roll": ("Roll (deg)", "Roll"),
    "normal": ("Normal Acceleration (G)", "NormAc"),
    "variation": ("Magnetic Variation (deg)", "MagVar"),
}
G5 = {name: both for name, both in G3X.items() if name not in ("offset", "time", "date", "utc")}
G5 = {
    "date": ("UTC Date (yyyy-mm-dd)", "UTC Date"),
    "utc": ("UTC Time (hh:mm:ss)", "UTC Time"),
    **G5,
    "altitude": ("GPS Altitude (WGS84 ft)", "AltGPS"),
    "track": ("GPS Ground Track (deg true)", "TRK"),
    "east": ("GPS Velocity E (m/s)", "GPS Velocity E (m/s)"),
    "north": ("GPS Velocity N (m/s)", "GPS Velocity N (m/s)"),
}
G1000 = {
    "date": ("#yyy-mm-dd", "Lcl Date"),
    "time": ("hh:mm:ss", "Lcl Time"),
    "offset": ("hh:mm", "UTCOfst"),
    "latitude": ("degrees", "Latitude"),
    "longitude": ("degrees", "Longitude"),
    "altitude": ("ft wgs", "AltGPS"),
    "speed": ("kt", "GndSpd"),
    "heading": ("deg", "HDG"),
    "track": ("deg", "TRK"),
    "variation": ("deg", "MagVar"),
}


def log(
    flight: Flight,
    names: dict[str, tuple[str, str]],
    top: str = G3X_TOP,
    without: tuple[str, ...] = (),
    renamed: dict[str, str] | None = None,
    short: bool = True,
) -> str:
    """A log with these columns; ``renamed`` gives other long names, ``short`` the row of short names."""
    kept = {name: both for name, both in names.items() if name not in without}
    cells = flight.columns()
    lines = [top, ",".join((renamed or {}).get(name, both[0]) for name, both in kept.items())]
    lines += [",".join(both[1] for both in kept.values())] if short else []
    lines += [",".join(row) for row in zip(*(cells[name] for name in kept), strict=True)]
    return "\n".join([*lines, ""])
