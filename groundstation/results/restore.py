"""Saved answers as dataclasses again: the contents of summary.json, rounded as written."""

from collections.abc import Mapping
from typing import Any

from groundstation.base.errors import GroundstationError, UnreadableLogError
from groundstation.base.serial import MismatchError, from_json, join
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.results.answer import A, Answer
from groundstation.results.document import SummaryDocument
from groundstation.results.flight import FlightResults


def restored(summary: Mapping[str, Any], where: str, answer_types: Mapping[str, type[Answer]]) -> FlightResults:
    """Restore the results of a flight from its summary.

    They are those of the run, but for the digits that summary.json leaves out.

    Parameters
    ----------
    summary : mapping
        The content of summary.json.
    where : str
        Source of the summary, for errors.
    answer_types : mapping of analysis name to dataclass
        Answers of other analyses are left out.

    Returns
    -------
    FlightResults
        Without arrays: they are in files of their own.

    Raises
    ------
    UnreadableLogError
        When the summary lacks what a result needs.
    """
    try:
        document = from_json(SummaryDocument, summary)
        flight, start = document.flight, document.flight.start_utc
        return FlightResults(
            flight.id,
            flight.source,
            flight.metadata,
            None if start is None else iso_to_utc_ns(start)[0],
            flight.duration_s,
            document.status,
            document.completeness,
            document.ledger,
            document.clock,
            document.findings,
            document.not_assessable,
            {name: restored_answer(summary, answer_types[name]) for name in document.results if name in answer_types},
        )
    except (MismatchError, GroundstationError) as error:
        what = f"a summary that cannot be used ({error})"
        raise UnreadableLogError(where, what, "one that this version writes", "run the log again") from error


def restored_answer(summary: Mapping[str, Any], answer_type: type[A]) -> A:
    """Restore one answer of a summary, whatever the rest of it is, without figures.

    Raises
    ------
    MismatchError
        When there is none, or it is not as this version writes it.
    """
    results = summary.get("results")
    try:
        return from_json(answer_type, results.get(answer_type.analysis) if isinstance(results, Mapping) else None)
    except MismatchError as error:
        place = join(f"results.{answer_type.analysis}", error.place)
        raise MismatchError(error.found, error.expected, place, error.next_step) from error
