"""Chapter on the sessions of several aircraft, each with the algorithm to trust.

Their reports are pages of their own.
"""

import numpy as np

from groundstation.chapters.fleet.common import aircraft_name, minute
from groundstation.chapters.parts import Cell, Grid, Head, Note, Section
from groundstation.chapters.wording import ABSENT, duration, number
from groundstation.results.fleet import FleetResults, SessionRow
from groundstation.systems.cooperative.chapter import state_of, title_of

LEAD = "Flights of several aircraft that ranged to one another over a data link, analysed together."
HEADS = (
    *(Head("Session"), Head("Aircraft"), Head("Start, UTC"), Head("Length", True), Head("Algorithm to trust")),
    *(Head("2σ_r, m", True), Head("INS alone, m", True), Head("RMS error, m", True), Head("Against the truth")),
    Head("Warnings", True),
)
CAPTION = (
    "2σ_r: computed, worst aircraft at the end; INS alone: the same for dead reckoning. A flight of a session is also "
    "in the table of the flights."
)
LONGEST_NAMES = 40


def build(fleet: FleetResults) -> Section | None:
    """Build the chapter; None without sessions."""
    if not fleet.sessions:
        return None
    grid = Grid("Sessions", HEADS, [_cells(row) for row in fleet.sessions], CAPTION)
    reports = [row.report for row in fleet.sessions if row.report]
    parts = (grid, Note("Reports:", files=reports)) if reports else (grid,)
    return Section("sessions", "Sessions of several aircraft", LEAD, parts)


def _cells(row: SessionRow) -> tuple[Cell, ...]:
    start = np.datetime64("NaT" if row.start_utc_ns is None else row.start_utc_ns, "ns")
    head = (row.session_id, aircraft_name(row.aircraft, LONGEST_NAMES), minute(start), duration(row.duration_s))
    warnings = number(float(row.findings_warn + row.findings_fail), 0)
    if not row.algorithm:
        return (*head, row.reason or ABSENT, *[ABSENT] * 4, warnings)
    figures = (row.two_sigma_r_m, row.reckoned_two_sigma_r_m, row.rms_m)
    judged = state_of(row)
    return (*head, title_of(row.algorithm), *(number(value, 1) for value in figures), judged, warnings)
