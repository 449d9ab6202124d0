"""Length of the field against the world magnetic model at the place and date of the log.

A fixed band of lengths calls the field of South Australia wrong and one doubled at the equator right. Where the log
has a place and a date, the model decides; the band stays for logs without.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from groundstation.base.declination import declination_along
from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NT_PER_GAUSS
from groundstation.systems.health.evidence import Evidence, FloatArray
from groundstation.tables.table import Flight

BY_BAND, BY_MODEL = "field_length_gauss", "field_against_model"


def against_the_model(flight: Flight, evidence: Iterable[Evidence]) -> tuple[Evidence, ...]:
    """Return the evidence, lengths of the field as shares that they are off the model's."""
    every = tuple(evidence)
    model = _model(flight) if any(one.quantity == BY_BAND for one in every) else None
    if model is None:
        return every
    name, gauss = model
    return tuple(
        replace(
            one,
            quantity=BY_MODEL,
            unit="",
            value=np.abs(one.value / gauss - 1.0),
            source=f"{one.source} against {gauss:.3f} gauss of the {name}",
        )
        if one.quantity == BY_BAND
        else one
        for one in every
    )


def first_position(flight: Flight) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return latitude, longitude and altitude of the first fix, shape (1,) each."""
    for topic in topics_of_kind("gnss", flight.topics()):
        table = flight[topic]
        if not table.has("latitude_deg", "longitude_deg"):
            continue
        rows = np.flatnonzero(table.valid("latitude_deg", "longitude_deg"))
        if len(rows):
            one = table.take(rows[:1])
            return one.values("latitude_deg"), one.values("longitude_deg"), np.nan_to_num(one.values("altitude_msl_m"))
    return None


def _model(flight: Flight) -> tuple[str, float] | None:
    """Return name and length, gauss, of the model's field; None where none serves."""
    place = first_position(flight)
    if place is None or not flight.has_utc:
        return None
    try:
        found = declination_along(*place, flight.start_ns)
    except NotAssessableError:
        return None
    length_nt = float(np.hypot(found.horizontal_nt[0], found.down_nt[0]))
    return (found.model, length_nt / NT_PER_GAUSS) if np.isfinite(length_nt) and length_nt > 0.0 else None
