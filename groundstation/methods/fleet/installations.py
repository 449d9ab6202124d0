"""Installations of a fleet as tables: one row each, and one for each of their flights."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from groundstation.results.arrays.fleet import FleetInstallationFlights
from groundstation.results.installations import NAMED_PROBABILITY, Installation, InstallationRow, InstalledFlight

NUMBERS = (
    *("error_deg", "half_width_deg", "alone_error_deg", "alone_half_width_deg"),
    *("platform_error_deg", "platform_standard_error_deg", "residual_deg", "residual_sigma_deg"),
)
BELIEVED = ("mounting_deg", "mounting_sigma_deg", "sum_deg", "sum_sigma_deg", "factor", "factor_sigma")


def installation_rows(installations: Sequence[Installation]) -> tuple[InstallationRow, ...]:
    """One row for each installation, numbered in their order."""
    rows = []
    for place, one in enumerate(installations, 1):
        believed = {} if one.installed is None else {name: getattr(one.installed, name) for name in BELIEVED}
        rows.append(
            InstallationRow(
                place=place,
                ins_serial=one.ins_serial,
                aircraft=one.aircraft,
                first_flight=one.lessons[0].flight_id,
                last_flight=one.lessons[-1].flight_id,
                flights=len(one.flights),
                taught=len(one.taught_by),
                odd=_named(one.taught_by, one.odd),
                changed=_named(one.taught_by, one.changed),
                pooled=one.pooled,
                **believed,
            )
        )
    return tuple(rows)


def _named(flights: Sequence[str], probability: Sequence[float]) -> str:
    return ", ".join(name for name, one in zip(flights, probability, strict=False) if one > NAMED_PROBABILITY)


def installation_flights(installations: Sequence[Installation]) -> FleetInstallationFlights:
    """Return one row for each flight: what earlier flights taught, its answers, its residual."""
    rows = [_flight(place, one, flight) for place, one in enumerate(installations, 1) for flight in one.flights]
    names = [one.name for one in fields(FleetInstallationFlights)]
    return FleetInstallationFlights(**{name: np.array([row[name] for row in rows]) for name in names})


def _flight(place: int, one: Installation, flight: InstalledFlight) -> dict[str, Any]:
    lesson, answer = flight.lesson, flight.answer
    believed = None if answer is None else answer.installed
    doubts = {name: (odd, changed) for name, odd, changed in zip(one.taught_by, one.odd, one.changed, strict=False)}
    odd, changed = doubts.get(lesson.flight_id, (np.nan, np.nan))
    return {
        "place": place,
        "aircraft": one.aircraft,
        "ins_serial": one.ins_serial,
        "flight_id": lesson.flight_id,
        "start_utc": np.datetime64(lesson.start_utc.removesuffix("Z"), "ns"),
        "not_taught": lesson.not_taught,
        "flights": 0 if answer is None else answer.flights,
        "verdict_alone": lesson.verdict,
        "verdict": "" if answer is None else answer.verdict,
        **{name: _number(None if answer is None else getattr(answer, name)) for name in NUMBERS},
        **{name: _number(None if believed is None else getattr(believed, name)) for name in BELIEVED},
        "odd": odd,
        "changed": changed,
    }


def _number(value: float | None) -> float:
    return np.nan if value is None else float(value)
