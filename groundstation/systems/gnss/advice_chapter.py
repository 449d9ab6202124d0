"""Advice on what a receiver should log next time."""

from collections.abc import Iterator
from fnmatch import fnmatchcase

from groundstation.chapters.chapter import Advice
from groundstation.results.flight import FlightResults
from groundstation.systems.gnss.answer import GnssReception

POSITIONS = ("raw.??GGA", "raw.??GNS", "raw.??RMC")  # sentences beside which a receiver can send GST
GST = "the NMEA sentence GST, the accuracy that the receiver claims"


def advise(results: FlightResults) -> Iterator[Advice]:
    """Yield GST where a log of sentences has a fix and no claim of its accuracy."""
    answer = results.answer(GnssReception)
    if answer is None or answer.receiver.first_fix_s is None:
        return
    claims = any(one.horizontal_sigma_m is not None for one in answer.receivers)
    topics = results.ledger.topics
    if not claims and any(fnmatchcase(topic, pattern) for topic in topics for pattern in POSITIONS):
        yield Advice("Record", GST, "GNSS reception")
