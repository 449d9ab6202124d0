"""Clock of a log against GNSS time, as far as the log itself tells it."""

import numpy as np

from groundstation.base.clock import Clock
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.systems.several_logs.settings import TwoClocksSettings

READERS_OF_GNSS_TIME = ("receiver", "rtklib-pos", "sbet")  # their own times are those of GNSS
OWN_SIGMA_S = 0.001


@dataclass(frozen=True)
class GnssStretch:
    """Stretch of a log with one offset and drift to GNSS time.

    GNSS time = own time + ``offset_s`` - ``drift`` (own time - ``middle_ns``).
    """

    begin_ns: int
    middle_ns: int
    offset_s: float
    sigma_s: float
    drift: float
    drift_sigma: float

    def offset_at(self, time_ns: int) -> float:
        """GNSS time less own time, seconds."""
        return self.offset_s - self.drift * (time_ns - self.middle_ns) / NS_PER_S

    def sigma_at(self, time_ns: int) -> float:
        """Return one sigma of :meth:`offset_at`, seconds."""
        return float(np.hypot(self.sigma_s, self.drift_sigma * (time_ns - self.middle_ns) / NS_PER_S))


@dataclass(frozen=True)
class GnssTime:
    """GNSS time of a log, in stretches.

    ``is_own``: the log's own clock runs on it; else messages told it to the recorder.
    """

    stretches: tuple[GnssStretch, ...]
    is_own: bool

    def at(self, time_ns: int) -> GnssStretch:
        """The stretch that a time of the log lies in."""
        return next((one for one in reversed(self.stretches) if one.begin_ns <= time_ns), self.stretches[0])


def gnss_time_of(clock: Clock, reader: str, settings: TwoClocksSettings | None = None) -> GnssTime | None:
    """GNSS time of a converted log; None where nothing tells it.

    Parameters
    ----------
    clock : Clock
        As the log's MCAP has it.
    reader : str
        That read the log: the times of a receiver's log are GNSS time.
    """
    settings = settings or TwoClocksSettings()
    if not clock.is_absolute:
        return None
    if reader.startswith(READERS_OF_GNSS_TIME):
        return GnssTime((GnssStretch(0, 0, 0.0, OWN_SIGMA_S, 0.0, 0.0),), is_own=True)
    told = [one for one in clock.relations if one.clock == "gnss" and one.segments]
    if not told:
        return None
    stretches = []
    for segment in max(told, key=lambda one: one.samples).segments:
        try:
            start_ns = iso_to_utc_ns(segment.start)[0]
        except GroundstationError:
            return None
        middle_ns = start_ns + round(0.5 * segment.length_s * NS_PER_S)
        sigma_ppm = settings.drift_sigma_ppm if segment.drift_sigma_ppm is None else segment.drift_sigma_ppm
        drift = 1e-6 * (segment.drift_ppm or 0.0)
        stretches.append(
            GnssStretch(
                start_ns,
                middle_ns,
                segment.offset_s,
                segment.offset_sigma_s,
                drift,
                1e-6 * float(np.hypot(sigma_ppm, segment.drift_ppm is None and settings.drift_sigma_ppm)),
            )
        )
    return GnssTime(tuple(stretches), is_own=False)
