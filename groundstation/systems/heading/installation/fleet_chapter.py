"""Chapter on how each INS sits in its aircraft and how the aircraft crabs.

Learned from the flights one by one.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.quantiles import NORMAL_95
from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.chapters.fleet.common import aircraft_name, bounded, day
from groundstation.chapters.gates import VERDICTS
from groundstation.chapters.parts import Cell, Figure, Grid, Head, Mark, Note, Part, Section
from groundstation.chapters.wording import ABSENT, clean, is_number, number, plural
from groundstation.results.fleet import FleetResults
from groundstation.results.installations import InstallationRow

TITLE = "Installations"
LEAD = (
    "How each INS sits in its aircraft, and how the aircraft crabs in a crosswind: what the flights of a serial say "
    "together, and what each flight's heading error is by what the earlier ones taught."
)
FAR = 3.0  # sigmas of a residual that is marked
OTHERS = {
    "compass_a_deg": ("A of the compass", "°", 2),
    "antenna_arm_m": ("antenna ahead of the main gear", "m", 2),
    "gnss_latency_s": ("latency of GNSS velocity", "s", 3),
}
MOST_LISTED = 20  # installations with a table of their own


def build(fleet: FleetResults) -> Section | None:
    """Build the chapter; None where no flight states the serial of its INS."""
    rows = fleet.installations
    if not rows:
        return None
    parts: list[Part] = [one for one in (_table(rows), _others(rows)) if one is not None]
    shown = [row for row in rows if row.taught][:MOST_LISTED]
    for row in shown:
        parts += [Figure("fleet.installation", str(row.place)), _flights(fleet, row)]
    left = len([row for row in rows if row.taught]) - len(shown)
    if left:
        parts.append(Note(f"{plural(left, 'installation')} more in installations.json."))
    return Section("installations", TITLE, LEAD, tuple(parts))


def rows_of(fleet: FleetResults, place: int) -> NDArray[np.intp]:
    """Return rows of the flights of an installation, in order of time."""
    return np.flatnonzero(fleet.installation_flights.place == place)


def name_of(row: InstallationRow) -> str:
    """Return an installation in words."""
    return f"{aircraft_name(row.aircraft, 24)}, serial {clean(row.ins_serial)[:24]}"


def _table(rows: Sequence[InstallationRow]) -> Grid:
    heads = (
        *(Head("Aircraft"), Head("Serial"), Head("First flight"), Head("Flights", True), Head("Taught", True)),
        *(Head("Mounting, ° ± 95 %", True), Head("with steady sideslip", True), Head("Factor, ° per m/s", True)),
        Head("Changes and odd flights"),
    )
    caption = (
        "Taxis see mounting and steady sideslip together: that sum is the better known. Factor: degrees of sideslip "
        "for each m/s of crosswind. Flights without azimuth from turns teach little where the heading was a stored one."
    )
    return Grid("Installations by serial", heads, [_row(row) for row in rows], caption)


def _row(row: InstallationRow) -> tuple[Cell, ...]:
    told = [f"changed: {clean(row.changed)}"] * bool(row.changed) + [f"odd: {clean(row.odd)}"] * bool(row.odd)
    return (
        *(aircraft_name(row.aircraft), clean(row.ins_serial), row.first_flight),
        *(number(row.flights, 0), number(row.taught, 0)),
        _between(row.mounting_deg, row.mounting_sigma_deg),
        _between(row.sum_deg, row.sum_sigma_deg),
        ABSENT if row.factor is None else f"{number(row.factor, 3)} (σ {number(row.factor_sigma, 3)})",
        Mark("warn", "; ".join(told)) if told else "none",
    )


def _between(value: float | None, sigma: float | None) -> str:
    if not (is_number(value) and is_number(sigma)):
        return ABSENT
    return f"{bounded(value, 2, signed=True)} ± {number(NORMAL_95 * sigma, 2)}"


def _others(rows: Sequence[InstallationRow]) -> Grid | None:
    """Return compass, antenna and latency of each installation; None without observations."""
    heads = (
        *(Head("Aircraft"), Head("Serial"), Head("Figure"), Head("Flights", True), Head("Value ± 95 %", True)),
        Head("Changes and odd flights"),
    )
    cells = []
    for row in rows:
        for one in row.pooled:
            title, unit, places = OTHERS[one.name]
            half = number(NORMAL_95 * one.sigma, places, unit)
            told = [f"changed: {', '.join(one.changed)}"] * bool(one.changed)
            told += [f"odd: {', '.join(one.odd)}"] * bool(one.odd)
            cells.append(
                (
                    *(aircraft_name(row.aircraft), clean(row.ins_serial), title, number(one.flights, 0)),
                    f"{bounded(one.value, places, signed=True)} ± {half}",
                    Mark("warn", clean("; ".join(told))) if told else "none",
                )
            )
    caption = (
        "Of all flights of the serial, changes and odd flights doubted as those of the mounting; never across serials."
    )
    return Grid("Other sensors by serial", heads, cells, caption) if cells else None


def _flights(fleet: FleetResults, row: InstallationRow) -> Grid:
    flights, rows = fleet.installation_flights, rows_of(fleet, row.place)
    heads = (
        *(Head("Flight"), Head("Day"), Head("Earlier flights", True), Head("Alone, °", True), Head("± ′", True)),
        *(Head("Learned, °", True), Head("± ′", True), Head("Verdict"), Head("Platform, °", True)),
        *(Head("Minus azimuth in flight, °", True), Head("Teaches")),
    )
    cells = []
    for place in rows.tolist():
        residual, sigma = float(flights.residual_deg[place]), float(flights.residual_sigma_deg[place])
        told = number(residual, 2, signed=True)
        verdict = str(flights.verdict[place])
        cells.append(
            (
                *(str(flights.flight_id[place]), day(flights.start_utc[place]), number(int(flights.flights[place]), 0)),
                bounded(flights.alone_error_deg[place], 2, signed=True),
                _arcmin(flights.alone_half_width_deg[place]),
                *(bounded(flights.error_deg[place], 2, signed=True), _arcmin(flights.half_width_deg[place])),
                VERDICTS.get(verdict, ABSENT),
                bounded(flights.platform_error_deg[place], 2, signed=True),
                Mark("warn", told) if np.isfinite(residual) and abs(residual) > FAR * sigma else told,
                _teaches(str(flights.not_taught[place]), float(flights.odd[place]), float(flights.changed[place])),
            )
        )
    caption = "Minus azimuth in flight: the learned number of the platform less what the turns of that flight showed."
    return Grid(f"Flights of {name_of(row)}", heads, cells, caption)


def _arcmin(value_deg: float) -> str:
    return number(float(value_deg) * ARCMIN_PER_DEG, 0)


def _teaches(not_taught: str, odd: float, changed: float) -> Cell:
    if not_taught:
        return clean(not_taught)
    if odd > 0.5:
        return Mark("warn", "taken for another unit's")
    return Mark("warn", "from here on it sits otherwise") if changed > 0.5 else "yes"
