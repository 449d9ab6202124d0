"""Steady sideslip and mounting: what one direction of taxi cannot show, and what is known of it beforehand.

Sideslip that a crosswind makes turns with the aircraft: as cos and sin of the track it takes the other sign on the way
back, so directions driven both ways show it. Mounting, and sideslip that is the same in every direction, never show.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.base.signals import topics_of_kind
from groundstation.estimators.heading.interval import Regressor
from groundstation.estimators.heading.settings import HeadingSettings
from groundstation.estimators.known import AircraftData
from groundstation.tables.table import Flight

FloatArray = NDArray[np.float64]
WIND_MPS = 10.0  # crosswind at which the sideslip has the stated sigma
WIND_FIELDS = ("wind_north_mps", "wind_east_mps")


@dataclass(frozen=True)
class SteadyPrior:
    """Sigmas of steady sideslip and of mounting, degrees; ``wind_mps`` north and east where the log has it.

    ``is_stated``: the aircraft file says how large one of them or both are.
    """

    sideslip_sigma_deg: float
    mounting_sigma_deg: float
    is_stated: bool
    wind_mps: tuple[float, float] | None = None

    def regressors(self, direction_deg: FloatArray) -> tuple[Regressor, ...]:
        """What the sideslip of a crosswind does to differences taken in these directions of motion, shape (n,)."""
        north, east = np.cos(np.deg2rad(direction_deg)), np.sin(np.deg2rad(direction_deg))
        if self.wind_mps is None:
            return tuple(Regressor(part, 0.0, self.sideslip_sigma_deg, is_apart=True) for part in (north, east))
        across = (self.wind_mps[1] * north - self.wind_mps[0] * east) / WIND_MPS
        return (Regressor(across, 0.0, self.sideslip_sigma_deg, is_apart=True),)


def steady_prior(
    flight: Flight, span_s: tuple[float, ...], aircraft: AircraftData, settings: HeadingSettings
) -> SteadyPrior:
    """What is known beforehand: the aircraft file's sigmas, else those of the settings; the wind logged over a span."""
    sideslip, mounting = aircraft.sideslip_sigma_deg, aircraft.mounting_sigma_deg
    return SteadyPrior(
        settings.sideslip_sigma_deg if sideslip is None else sideslip,
        settings.mounting_sigma_deg if mounting is None else mounting,
        sideslip is not None or mounting is not None,
        _wind(flight, span_s),
    )


def _wind(flight: Flight, span_s: tuple[float, ...]) -> tuple[float, float] | None:
    """Median wind over a span of flight time, m/s north and east; None where the log has none."""
    for topic in topics_of_kind("air", flight.topics()):
        table, time_s = flight[topic], flight.time_s(topic)
        if not table.has(*WIND_FIELDS):
            continue
        inside = (time_s >= span_s[0]) & (time_s <= span_s[1])
        north, east = (table.values(name)[inside] for name in WIND_FIELDS)
        known = np.isfinite(north) & np.isfinite(east)
        if known.any():
            return float(np.median(north[known])), float(np.median(east[known]))
    return None
