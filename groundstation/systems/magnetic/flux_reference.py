"""True heading for a flux valve: best trajectory, INS, or the wind solved."""

import math
from collections.abc import Mapping

import numpy as np

from groundstation.base.angles import FloatArray, direction_of, mean_heading, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import S_PER_H
from groundstation.results.arrays.states import BodyStates
from groundstation.results.roles import AzimuthByTurns, HeadingByTrack, StatesAlongTheFlight
from groundstation.systems.known import AircraftData
from groundstation.systems.magnetic.alignment import align
from groundstation.systems.magnetic.by_states import reference_of
from groundstation.systems.magnetic.flux_answer import FluxReference, ReferenceName
from groundstation.systems.magnetic.flux_epochs import ANALYSIS, GAP_S, FluxEpochs
from groundstation.systems.magnetic.flux_settings import MagneticFluxSettings
from groundstation.systems.magnetic.flux_wind import SolvedWind, leg_errors_by_wind, solve_wind
from groundstation.systems.magnetic.readings import why_not_independent
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.resample import values_at
from groundstation.tables.table import Flight

Rows = tuple[int, int]
KNOWN_SHARE = 0.8  # of the epochs of a leg that have a true heading


@dataclass(frozen=True)
class OtherAnswers:
    """Answers of the same flight that tell of the true heading."""

    states: StatesAlongTheFlight | None = None
    heading: HeadingByTrack | None = None
    by_turns: AzimuthByTurns | None = None
    kinds: Mapping[str, str] | None = None
    aircraft: AircraftData | None = None


@dataclass(frozen=True)
class TrueHeadings:
    """True heading at every epoch, (n,), and of every leg, (m,), NaN where unknown.

    ``leg_covariance`` (m, m) is without ``common_sigma_deg``, which all share, and ``own_sigma_deg`` of each leg.
    """

    references: tuple[FluxReference, ...]
    true_deg: FloatArray
    leg_true_deg: FloatArray
    leg_covariance: FloatArray
    common_sigma_deg: float
    own_sigma_deg: float
    wind: SolvedWind | None = None


def true_headings(
    flight: Flight,
    topic: str,
    epochs: FluxEpochs,
    legs: list[Rows],
    settings: MagneticFluxSettings,
    magnetic: MagneticSettings,
    others: OtherAnswers,
) -> TrueHeadings:
    """Return the true heading by the first reference that the log has.

    They are, in this order: states whose checks hold, an INS heading with no compass in it, GNSS velocity and true
    airspeed with the wind solved.

    Raises
    ------
    NotAssessableError
        When there is none; the reason of each.
    """
    missing: list[FluxReference] = []
    for find in (_by_states, _by_ins, _by_wind):
        found = find(flight, topic, epochs, legs, settings, magnetic, others)
        if isinstance(found, TrueHeadings):
            return TrueHeadings(
                (*found.references, *missing),
                found.true_deg,
                found.leg_true_deg,
                found.leg_covariance,
                found.common_sigma_deg,
                found.own_sigma_deg,
                found.wind,
            )
        missing.append(found)
    told = "; ".join(one.reason for one in missing if one.reason)
    raise NotAssessableError(ANALYSIS, f"no true heading to compare with: {told}")


def _by_states(
    flight: Flight,
    topic: str,
    epochs: FluxEpochs,
    legs: list[Rows],
    settings: MagneticFluxSettings,
    magnetic: MagneticSettings,
    others: OtherAnswers,
) -> "TrueHeadings | FluxReference":
    reference = reference_of(others.states, magnetic)
    if reference is None:
        return FluxReference("states", "", False, None, "no best trajectory whose checks hold")
    states: BodyStates = reference.states.at(epochs.time_s)
    known = np.isfinite(states.true_heading_deg) & epochs.is_airborne
    if not known.any():
        return FluxReference("states", "", False, None, "the best trajectory has no heading in flight")
    aircraft = others.aircraft or AircraftData()
    mounting = magnetic.mounting_sigma_deg if aircraft.mounting_sigma_deg is None else aircraft.mounting_sigma_deg
    sigma = math.hypot(float(np.median(states.true_heading_sigma_deg[known])), mounting)
    return _direct("states", "", wrap_360(states.true_heading_deg), sigma, 0.0, epochs, legs)


def _by_ins(
    flight: Flight,
    topic: str,
    epochs: FluxEpochs,
    legs: list[Rows],
    settings: MagneticFluxSettings,
    magnetic: MagneticSettings,
    others: OtherAnswers,
) -> "TrueHeadings | FluxReference":
    reasons = []
    units = topics_of_kind("ins", flight.topics())
    for unit in units:
        if not flight[unit].has("true_heading_deg"):
            continue
        reason = why_not_independent(flight, unit, dict(others.kinds or {}), magnetic)
        if reason:
            reasons.append(reason)
            continue
        table = flight[unit].trusted().unique_times()
        true = values_at(table, "true_heading_deg", epochs.time_ns, largest_gap_s=GAP_S)
        known = np.isfinite(true) & epochs.is_airborne
        if not known.any():
            reasons.append(f"{unit} has no true heading in flight")
            continue
        aircraft = others.aircraft or AircraftData()
        middle = float(np.median(epochs.time_s[known]))
        found = align(others.heading, unit, middle, magnetic, by_turns=others.by_turns, aircraft=aircraft)
        true = wrap_360(true - aircraft.mounting_deg - found.error_deg)
        return _direct("ins", unit, true, found.sigma_deg, found.drift_sigma_deg_per_h, epochs, legs, found.origin)
    return FluxReference("ins", "", False, None, "; ".join(reasons) or "no INS with a true heading")


def _direct(
    name: ReferenceName,
    topic: str,
    true_deg: FloatArray,
    sigma_deg: float,
    drift_sigma_deg_per_h: float,
    epochs: FluxEpochs,
    legs: list[Rows],
    origin: str = "",
) -> TrueHeadings:
    by_leg = np.full(len(legs), np.nan)
    middle_s = np.array([np.mean(epochs.time_s[first:last]) for first, last in legs])
    for place, (first, last) in enumerate(legs):
        mine = true_deg[first:last]
        if np.mean(np.isfinite(mine)) >= KNOWN_SHARE:
            by_leg[place] = mean_heading(mine[np.isfinite(mine)])
    hours = (middle_s - np.mean(middle_s)) / S_PER_H if legs else middle_s
    covariance = drift_sigma_deg_per_h**2 * np.outer(hours, hours)
    told = FluxReference(name, topic, True, sigma_deg, origin)
    return TrueHeadings((told,), true_deg, by_leg, covariance, sigma_deg, 0.0)


def _by_wind(
    flight: Flight,
    topic: str,
    epochs: FluxEpochs,
    legs: list[Rows],
    settings: MagneticFluxSettings,
    magnetic: MagneticSettings,
    others: OtherAnswers,
) -> "TrueHeadings | FluxReference":
    if not np.isfinite(epochs.velocity_mps).any():
        return FluxReference("wind", "", False, None, "no GNSS velocity")
    if not np.isfinite(epochs.airspeed_mps).any():
        return FluxReference("wind", "", False, None, "no true airspeed to solve the wind with")
    usable = [one for one in legs if np.mean(np.isfinite(epochs.velocity_mps[one[0] : one[1], 0])) >= KNOWN_SHARE]
    wind = solve_wind(epochs, usable, settings)
    if wind is None:
        return FluxReference("wind", "", False, None, "no straight leg with GNSS velocity and true airspeed")
    air = epochs.velocity_mps - wind.wind_mps
    true = direction_of(air[:, 0], air[:, 1])
    by_leg, covariance = np.full(len(legs), np.nan), np.zeros((len(legs), len(legs)))
    places = [legs.index(one) for one in usable]
    by_leg[places], covariance[np.ix_(places, places)] = leg_errors_by_wind(epochs, usable, wind)
    sigma = settings.sideslip_sigma_deg
    told = FluxReference("wind", epochs.gnss_topic, True, sigma, "a steady sideslip counts in A")
    return TrueHeadings((told,), true, by_leg, covariance, sigma, settings.leg_slip_sigma_deg, wind)
