"""Shortfalls of a flight for the deviation of a flux valve, from what was flown."""

import numpy as np

from groundstation.base.angles import mean_heading
from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import topics_of_kind
from groundstation.systems.analysis import Shortfall
from groundstation.systems.known import Known
from groundstation.systems.magnetic.flux_epochs import (
    ANALYSIS,
    FluxEpochs,
    find_legs,
    gather_epochs,
    heading_topic,
    is_computed_from,
)
from groundstation.systems.magnetic.flux_settings import MagneticFluxSettings
from groundstation.systems.magnetic.ground_fit import directions_of, widest_gap_deg
from groundstation.systems.magnetic.readings import why_not_independent
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.table import Flight

ENOUGH_DIRECTIONS = 4


def examine_flux(flight: Flight, known: Known, settings: MagneticFluxSettings) -> tuple[Shortfall, ...]:
    """Judge the legs of a flight: their headings must go round the circle.

    Raises
    ------
    NotAssessableError
        Where nothing can be estimated, with the reason that the estimate would give.
    """
    topic = heading_topic(flight)
    epochs = gather_epochs(flight, topic, known.phases, settings)
    if is_computed_from(flight, topic, epochs):
        raise NotAssessableError(ANALYSIS, f"the magnetic heading of {topic} is its true heading less a variation")
    reason = _without_reference(flight, epochs, known)
    if reason:
        raise NotAssessableError(ANALYSIS, reason)
    legs = find_legs(epochs, settings)
    if not legs:
        return (Shortfall(f"no straight leg in flight of {settings.leg_min_s:g} s"),)
    heading = np.array([mean_heading(epochs.heading_deg[first:last]) for first, last in legs])
    directions = len(directions_of(heading, settings.repeat_within_deg))
    gap = widest_gap_deg(heading)
    if directions >= ENOUGH_DIRECTIONS and gap <= settings.gap_max_deg:
        return ()
    spans = tuple((float(epochs.time_s[first]), float(epochs.time_s[last - 1])) for first, last in legs)
    text = f"straight legs on {directions} directions, widest gap {gap:.0f} deg: A, B and C need four round the circle"
    return (Shortfall(text, spans),)


def _without_reference(flight: Flight, epochs: FluxEpochs, known: Known) -> str:
    """Return why there is no true heading to compare with; empty where there may be one."""
    magnetic = known.settings_of(MagneticSettings)
    units = [unit for unit in topics_of_kind("ins", flight.topics()) if flight[unit].has("true_heading_deg")]
    if any(not why_not_independent(flight, unit, {}, magnetic) for unit in units):
        return ""
    if np.isfinite(epochs.velocity_mps).any() and np.isfinite(epochs.airspeed_mps).any():
        return ""
    return "no true heading with no compass in it, and no GNSS velocity with true airspeed"
