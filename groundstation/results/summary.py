"""summary.json: the answers of one flight as plain values.

Each is rounded to its stated digits, NaN is null.
"""

from typing import Any

from groundstation.base.digits import digits_of as digits_of
from groundstation.base.serial import to_json
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.results.document import SCHEMA_VERSION as SCHEMA_VERSION
from groundstation.results.document import FlightDocument, SummaryDocument
from groundstation.results.flight import FlightResults


def summary_of(results: FlightResults) -> dict[str, Any]:
    """Build the content of summary.json.

    Parameters
    ----------
    results : FlightResults

    Returns
    -------
    dict
        JSON values only; keys in the order of the contract. The schema is schemas/summary.schema.json.
    """
    flight = FlightDocument(
        id=results.flight_id,
        aircraft=results.metadata.get("aircraft", ""),
        flight=results.metadata.get("flight", ""),
        start_utc=None if results.start_utc_ns is None else utc_ns_to_iso(results.start_utc_ns),
        duration_s=results.duration_s,
        source=results.source,
        metadata=dict(sorted(results.metadata.items())),
    )
    document = SummaryDocument(
        SCHEMA_VERSION,
        flight,
        results.status,
        dict(sorted(results.completeness.items())),
        results.ledger,
        results.clock,
        results.findings,
        results.not_assessable,
        results.answers,
    )
    plain: dict[str, Any] = to_json(document)
    return plain
