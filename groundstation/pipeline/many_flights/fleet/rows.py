"""Rows, checks, forecast skill and samples that one flight adds to the fleet.

Each is made from what the flight saved.
"""

from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.records import MAX_TEXT_CHARACTERS
from groundstation.base.signals import topics_of_kind
from groundstation.methods.fleet.density import SampleHistogram, histogram_of
from groundstation.methods.fleet.moments import Moments, moments_of
from groundstation.pipeline.many_flights.fleet.columns import FLIGHT_COLUMNS, FlightShare, answer_values
from groundstation.pipeline.many_flights.fleet.samples import SampleStore
from groundstation.reports.index import index_row, reasons_of
from groundstation.results.columns import Kind
from groundstation.results.files import SavedFlight, load, utf8_text
from groundstation.results.fleet import SessionRow
from groundstation.results.fleet_share import FleetSamples, SystemShare, to_number
from groundstation.results.installations import Lesson
from groundstation.systems import systems
from groundstation.tables.session_tracks import aircraft_named

LATEST_NS = 7_000_000_000_000_000_000  # 2191: times of samples must fit beside the start


def flight_row(saved: SavedFlight, samples: FleetSamples | None) -> dict[str, Any]:
    """Build the row of a flight.

    It has a value for every one of :data:`FLIGHT_COLUMNS`, of the type of its kind.
    """
    results = saved.results
    start = results.start_utc_ns
    start = start if start is not None and abs(start) < LATEST_NS else None
    moments = moments_of(samples.about_estimate_deg) if samples is not None else Moments()
    found: dict[str, Any] = vars(index_row(saved)) | {
        "flight_id": saved.folder.name,
        "start_utc": start,
        "month": "" if start is None else str(np.datetime64(start, "ns").astype("datetime64[M]")),
        "has_lost_data": results.ledger.loses_data,
        "not_assessable": "; ".join(reasons_of(results)),
        **answer_values(results),
    }
    if moments.count:
        found |= {"samples": moments.count, "sample_mean_deg": moments.mean, "sample_m2_deg2": moments.m2}
    return {column.name: _typed(column.kind, found.get(column.name)) for column in FLIGHT_COLUMNS}


def _typed(kind: Kind, value: Any) -> Any:
    if kind in ("number", "count"):
        return to_number(value)
    if kind in ("flag", "time"):
        return value
    return "" if value is None else utf8_text(value)[:MAX_TEXT_CHARACTERS]


def session_row(saved: SavedFlight) -> SessionRow:
    """Build the row of a session: what its report says on top."""
    results, indexed = saved.results, index_row(saved, "session")
    row = SessionRow(
        saved.folder.name,
        indexed.aircraft or "",
        results.start_utc_ns,
        to_number(results.duration_s),
        results.status,
        findings_fail=indexed.findings_fail or 0,
        findings_warn=indexed.findings_warn or 0,
        reason="; ".join(reasons_of(results)),
        report=indexed.report or "",
        recording=indexed.recording or "",
    )
    for one in systems().in_fleet:
        row = row if one.row is None else one.row(saved, row)
    return row


def shares_of(saved: SavedFlight) -> list[SystemShare]:
    """Return what each system adds of a flight, in their order.

    Raises
    ------
    UnreadableLogError
        When a file that one reads is broken.
    """
    return [one.share(saved) for one in systems().in_fleet if one.share is not None]


def share_of(folder: Path, store: SampleStore | None = None) -> FlightShare:
    """Read a flight folder; with ``store`` its heading samples are put there.

    Raises
    ------
    GroundstationError
        When the folder cannot be read.
    OSError
        When the samples cannot be written.
    """
    saved = load(folder, systems().answer_types)
    results, shares = saved.results, shares_of(saved)
    samples = next((one.samples for one in shares if one.samples is not None), None)
    row = flight_row(saved, samples)
    empty = SampleHistogram(np.zeros(0, np.int32), np.zeros(0, np.int32))
    return FlightShare(
        row,
        index_row(saved, "flight", answer_values(results)),
        histogram_of(samples.about_estimate_deg) if samples is not None else empty,
        next((one.shipped for one in shares if one.shipped), ""),
        [skill for one in shares for skill in one.skill],
        [check for one in shares for check in one.checks],
        saved.manifest.source.path,
        aircraft_named(results.metadata, results.source.name),
        tuple(topic.partition(".")[2] for topic in topics_of_kind("link", tuple(results.ledger.topics))),
        store.put(row, samples) if samples is not None and store is not None else "",
        tuple(part.sha256 for part in saved.manifest.parts[1:]),
        lesson_of(saved),
        [unit for one in shares for unit in one.units],
    )


def lesson_of(saved: SavedFlight) -> Lesson | None:
    """Lesson of a flight on its installation.

    None where it states no serial, or no system learns.
    """
    learn = systems().learn
    return None if learn is None else learn.lesson(saved)
