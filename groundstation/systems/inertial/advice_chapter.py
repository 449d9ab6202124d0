"""Advice of the INS errors: what to record and check for them."""

from collections.abc import Iterator

from groundstation.chapters.chapter import Advice
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.claim_chapter import is_start_unknown

PURPOSE = "INS errors"


def advise(results: FlightResults) -> Iterator[Advice]:
    """Yield what the answer did not learn of the INS."""
    answer = results.answer(InertialResult)
    if answer is None:
        return
    if answer.kind == "gnss_aided":
        yield Advice("Record", "the free-inertial output of the INS", PURPOSE)
    if answer.kind == "unknown":
        yield Advice("Check", "whether GNSS corrects this INS (ins_kind of the aircraft file)", PURPOSE)
    if is_start_unknown(answer):
        yield Advice("Check", "when the INS began to navigate (nav_start_utc of the aircraft file)", PURPOSE)
