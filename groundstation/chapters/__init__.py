"""Chapters: what the answers of a flight say, told once, without markup."""

from collections.abc import Callable
from typing import NamedTuple

from groundstation.chapters.cooperative import cooperative, is_session
from groundstation.chapters.forecast import forecast
from groundstation.chapters.generic import generic
from groundstation.chapters.heading import heading
from groundstation.chapters.inertial import inertial
from groundstation.chapters.landing import landing
from groundstation.chapters.latency import latency
from groundstation.chapters.magnetic import magnetic
from groundstation.chapters.parts import Section
from groundstation.results.answer import Answer
from groundstation.results.cooperative import CooperativeResult
from groundstation.results.flight import FlightResults
from groundstation.results.forecast import ForecastResult
from groundstation.results.heading import HeadingResult
from groundstation.results.inertial import InertialResult
from groundstation.results.landing import LandingResult
from groundstation.results.latency import Latencies
from groundstation.results.magnetic import MagneticResult
from groundstation.results.magnetic_ground import GroundDeviation


class Chapter(NamedTuple):
    """A chapter of its own: the answers it tells, and what builds it; None where it has nothing to say."""

    answers: tuple[type[Answer], ...]
    build: Callable[[FlightResults], Section | None]


# In the order of the report. An answer that none of them tells has the generic chapter.
FLIGHT_CHAPTERS: tuple[Chapter, ...] = (
    Chapter((HeadingResult,), heading),
    Chapter((InertialResult,), inertial),
    Chapter((ForecastResult,), forecast),
    Chapter((Latencies,), latency),
    Chapter((MagneticResult, GroundDeviation), magnetic),
    Chapter((LandingResult,), landing),
)
SESSION_CHAPTERS: tuple[Chapter, ...] = (Chapter((CooperativeResult,), cooperative),)


def chapters_of(results: FlightResults) -> tuple[Section, ...]:
    """The chapters on the answers of a flight or session: those of their own, then a generic one for every other."""
    listed = SESSION_CHAPTERS if is_session(results) else FLIGHT_CHAPTERS
    own = [chapter.build(results) for chapter in listed]
    return (
        *(section for section in own if section is not None),
        *(generic(results, answer) for answer in without_chapter(results)),
    )


def without_chapter(results: FlightResults) -> tuple[Answer, ...]:
    """The answers that no chapter of its own tells."""
    told = tuple(kind for chapter in (*FLIGHT_CHAPTERS, *SESSION_CHAPTERS) for kind in chapter.answers)
    return tuple(answer for answer in results.answers.values() if not isinstance(answer, told))
