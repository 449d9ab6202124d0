"""Steady sideslip and mounting, which one direction of taxi cannot show, and their priors.

Sideslip of an aircraft on its wheels comes from the side force of the wind across its path. Wind from the left pushes
the aircraft to the right; the tyres hold against it with the nose to the left of the path, into the wind:

    heading - track = -factor x (wind across the path, from the left)

Worked example: an L-39 (0.027 deg per m/s) with 10 m/s from the left has -0.27 deg. On the way back the sideslip
takes the other sign. Mounting, and sideslip that is the same in every direction, never show.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.metar import metar_winds, nearest_wind
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.methods.taxi_error.interval import Regressor
from groundstation.systems.heading.answer import TaxiWind
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.known import AircraftClass, AircraftData, SiteData
from groundstation.tables.table import Flight
from groundstation.tables.vehicle import is_stated_to_roll

FloatArray = NDArray[np.float64]
STATED_AT_MPS = 10.0  # crosswind at which the sideslip has a stated sigma
WIND_FIELDS = ("wind_north_mps", "wind_east_mps")
# Sideslip by crosswind, deg per m/s: mean and sigma, half of the mean. Side area, weight and tyres of an L-39, Citation
# II, A320 and C172; a car and a small unmanned aircraft on wheels by the same sum. Not stated: wide enough for most.
FACTORS: Mapping[AircraftClass, tuple[float, float]] = {
    "light": (0.051, 0.0255),
    "jet trainer": (0.027, 0.0135),
    "business jet": (0.038, 0.019),
    "airliner": (0.031, 0.0155),
    "car": (0.011, 0.0055),
    "uav": (0.15, 0.075),
    "": (0.035, 0.05),
}


@dataclass(frozen=True)
class SteadyPrior:
    """Prior knowledge of the steady terms, degrees.

    Parameters
    ----------
    factor, factor_sigma : float
        Sideslip by crosswind, deg per m/s.
    along_sigma_deg : float
        Sigma of the sideslip that the unknown part of the wind makes, along either axis.
    same_sigma_deg : float
        Of sideslip that is the same in every direction.
    mounting_deg, mounting_sigma_deg : float
        Heading of the INS case minus that of the airframe.
    is_stated : bool
        The aircraft file says how large one of the sigmas is.
    wind : TaxiWind, optional
        Wind of log or METAR line.
    """

    factor: float
    factor_sigma: float
    along_sigma_deg: float
    same_sigma_deg: float
    mounting_deg: float
    mounting_sigma_deg: float
    is_stated: bool
    aircraft_class: str = ""
    wind: TaxiWind | None = None

    def from_left_mps(self, direction_deg: FloatArray) -> FloatArray:
        """Known wind across a path in these directions, from the left positive, m/s, shape (n,)."""
        if self.wind is None:
            return np.zeros(len(direction_deg))
        north, east = np.cos(np.deg2rad(direction_deg)), np.sin(np.deg2rad(direction_deg))
        return np.asarray(self.wind.east_mps * north - self.wind.north_mps * east)

    def sideslip_deg(self, direction_deg: FloatArray) -> FloatArray:
        """Heading minus track as the known wind makes it by the mean factor, shape (n,)."""
        return -self.factor * self.from_left_mps(direction_deg)

    def regressors(self, direction_deg: FloatArray) -> tuple[Regressor, ...]:
        """Return the regressors of the sideslip by crosswind in these directions of motion, (n,).

        They hold what remains unknown of it.
        """
        north, east = np.cos(np.deg2rad(direction_deg)), np.sin(np.deg2rad(direction_deg))
        wind = (0.0, 0.0) if self.wind is None else (self.wind.east_mps, -self.wind.north_mps)
        speed_mps = float(np.hypot(*wind))
        across = (wind[0] / speed_mps, wind[1] / speed_mps) if speed_mps else (1.0, 0.0)
        along_deg = self.along_sigma_deg
        return (  # the mean wind from the left, where the factor is uncertain too, and a quarter turn from it
            Regressor(
                across[0] * north + across[1] * east,
                0.0,
                float(np.hypot(along_deg, self.factor_sigma * speed_mps)),
                is_apart=True,
            ),
            Regressor(across[0] * east - across[1] * north, 0.0, along_deg, is_apart=True),
        )


def steady_prior(
    flight: Flight,
    span_s: tuple[float, ...],
    aircraft: AircraftData,
    settings: HeadingSettings,
    site: SiteData | None = None,
    weather: Iterable[str] = (),
) -> SteadyPrior:
    """Return the prior of the steady terms: stated sigmas, else those of the class.

    The wind is that of the log, else of a METAR line.
    """
    kind = aircraft_class_of(flight, aircraft)
    factor, factor_sigma = FACTORS[kind]
    stated = settings.sideslip_sigma_deg if aircraft.sideslip_sigma_deg is None else aircraft.sideslip_sigma_deg
    wind = _logged_wind(flight, span_s, settings) or _reported_wind(flight, span_s, settings, site, tuple(weather))
    if stated is not None:
        factor_sigma = stated / STATED_AT_MPS
    usual = float(np.hypot(factor, factor_sigma))
    along = usual * (settings.ordinary_wind_mps if wind is None else wind.sigma_mps)
    same, mounting = aircraft.steady_sideslip_sigma_deg, aircraft.mounting_sigma_deg
    same_sigma_deg = settings.steady_sideslip_sigma_deg if same is None else same
    is_uneven = aircraft.taxi_power == "uneven"
    return SteadyPrior(
        factor=factor,
        factor_sigma=factor_sigma,
        along_sigma_deg=stated if stated is not None and wind is None else along,
        same_sigma_deg=max(same_sigma_deg, settings.uneven_power_sigma_deg) if is_uneven else same_sigma_deg,
        mounting_deg=aircraft.mounting_deg,
        mounting_sigma_deg=settings.mounting_sigma_deg if mounting is None else mounting,
        is_stated=is_uneven or any(one is not None for one in (aircraft.sideslip_sigma_deg, same, mounting)),
        aircraft_class=kind,
        wind=wind,
    )


def aircraft_class_of(flight: Flight, aircraft: AircraftData) -> AircraftClass:
    """Return the class stated, or that of a car.

    It is a car where the log or the aircraft file says that it only rolls.
    """
    if aircraft.aircraft_class:
        return aircraft.aircraft_class
    rolls = is_stated_to_roll(flight.metadata) or aircraft.stated_vehicle == "rolls"
    return "car" if rolls else ""


def _logged_wind(flight: Flight, span_s: tuple[float, ...], settings: HeadingSettings) -> TaxiWind | None:
    """Median wind over a span of flight time; None where the log has none."""
    for topic in topics_of_kind("air", flight.topics()):
        table, time_s = flight[topic], flight.time_s(topic)
        if not table.has(*WIND_FIELDS):
            continue
        inside = (time_s >= span_s[0]) & (time_s <= span_s[1])
        north, east = (table.values(name)[inside] for name in WIND_FIELDS)
        known = np.isfinite(north) & np.isfinite(east)
        if known.any():
            middle = float(np.median(north[known])), float(np.median(east[known]))
            return TaxiWind(*middle, settings.wind_sigma_mps, "log")
    return None


def _reported_wind(
    flight: Flight,
    span_s: tuple[float, ...],
    settings: HeadingSettings,
    site: SiteData | None,
    weather: tuple[str, ...],
) -> TaxiWind | None:
    """Return the wind of the METAR line nearest to the middle of a span.

    None where there is none, or the log has no UTC.
    """
    if not weather or not flight.has_utc:
        return None
    at_ns = flight.start_ns + round(0.5 * (span_s[0] + span_s[1]) * NS_PER_S)
    longest_ns = round(settings.weather_max_min * 60.0) * NS_PER_S
    wind, _away_ns = nearest_wind(metar_winds(weather), at_ns, longest_ns, site.station if site else "")
    if wind is None:
        return None
    return TaxiWind(wind.north_mps, wind.east_mps, max(wind.sigma_mps, settings.wind_sigma_mps), f"METAR {wind.name}")
