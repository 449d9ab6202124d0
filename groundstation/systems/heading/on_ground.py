"""Heading estimator as others use it: on a part of the ground before lift-off.

The limits of speed may differ from those of taxi.
"""

from dataclasses import field, replace

from groundstation.base.dataclasses import dataclass
from groundstation.methods.roles import HeadingOnGround
from groundstation.results.roles import Delays
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.estimate import estimate_heading_error
from groundstation.systems.heading.settings import HeadingRequest, HeadingSettings
from groundstation.systems.known import AircraftData, Known, SiteData
from groundstation.tables.phases import ground_mask
from groundstation.tables.table import Flight


@dataclass(frozen=True)
class Estimator:
    """Inputs of the estimate besides the flight.

    They are settings, aircraft, the user's intervals, latencies, airfield and METAR. It meets
    :class:`groundstation.methods.roles.FindHeadingError`.
    """

    settings: HeadingSettings = field(default_factory=HeadingSettings)
    aircraft: AircraftData = field(default_factory=AircraftData)
    request: HeadingRequest = field(default_factory=HeadingRequest)
    latencies: Delays | None = None
    site: SiteData | None = None
    weather: tuple[str, ...] = ()

    def __call__(
        self, part: Flight, whole: Flight, ins_topic: str, speeds_mps: tuple[float, float] | None = None
    ) -> HeadingResult:
        settings = replace(self.settings, runs="before_take_off")
        if speeds_mps is not None:
            settings = replace(settings, taxi_speed_min_mps=speeds_mps[0], taxi_speed_max_mps=speeds_mps[1])
        return estimate_heading_error(
            part,
            on_ground=lambda time_ns: ground_mask(whole, time_ns),
            settings=settings,
            aircraft=self.aircraft,
            request=replace(self.request, ins_topic=ins_topic),
            latencies=self.latencies,
            site=self.site,
            weather=self.weather,
        )


def offered(known: Known) -> HeadingOnGround:
    """Return the role as the heading analysis offers it.

    Intervals that have no place on the flight are left out.
    """
    return HeadingOnGround(
        Estimator(
            settings=known.settings_of(HeadingSettings),
            aircraft=known.aircraft,
            request=HeadingRequest(intervals=() if known.intervals_problem else known.intervals),
            latencies=known.answer_meeting(Delays),
            site=known.site,
            weather=known.weather,
        )
    )
